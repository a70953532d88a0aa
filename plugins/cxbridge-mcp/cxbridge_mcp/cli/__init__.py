"""The command of this plug-in."""
