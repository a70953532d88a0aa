"""The components of the server, one module each."""
