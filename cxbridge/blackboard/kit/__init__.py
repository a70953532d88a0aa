"""Common parts of the transports in `zmq` and `fawkesnet`, and of transports of plug-ins."""
