"""The store on MongoDB, with change streams and replica set status."""
