"""Where things are: coordinate frames over time, and navigation graphs."""
