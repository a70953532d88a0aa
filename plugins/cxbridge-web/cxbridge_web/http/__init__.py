"""HTTP infrastructure: a server in a thread, and an application for recorded runs."""
