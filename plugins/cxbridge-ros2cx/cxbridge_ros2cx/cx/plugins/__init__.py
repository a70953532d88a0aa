"""The plug-ins of the executive, one per module."""
