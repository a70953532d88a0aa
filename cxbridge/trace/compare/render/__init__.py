"""Renders comparisons: text for people, a page, JSON, JUnit."""
