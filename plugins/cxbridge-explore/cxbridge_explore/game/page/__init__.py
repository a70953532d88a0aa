"""The page about a game."""
