"""Output of comparisons: text, page, JSON and JUnit."""
