"""Common parts of the transport in `zmq` and of transports of plug-ins."""
