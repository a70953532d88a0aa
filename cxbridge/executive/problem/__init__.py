"""A planning problem that is edited: its knowledge, the place where that is kept, and truth."""
