"""The servers of the page and of Foxglove as components of runs and daemons."""
