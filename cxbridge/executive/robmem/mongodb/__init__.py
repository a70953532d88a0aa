"""The robot memory on MongoDB, with change streams and the state of its replica set."""
