"""Output of comparisons: text, JSON and JUnit."""
