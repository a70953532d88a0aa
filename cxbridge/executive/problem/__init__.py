"""A planning problem that is edited: what is known of it, where that is kept, what is true."""
