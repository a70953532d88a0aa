"""Explains why a rule has not fired: matches its condition element by element and shows the mismatch."""
