"""HTTP as such: a server in a thread, and an application that has files only."""
