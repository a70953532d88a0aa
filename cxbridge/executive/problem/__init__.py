"""Editable planning problems: knowledge, storage and truth."""
