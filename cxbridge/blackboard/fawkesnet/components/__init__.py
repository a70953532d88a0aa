"""Components of the server."""
