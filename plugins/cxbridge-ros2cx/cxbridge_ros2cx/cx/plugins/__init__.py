"""The plug-ins of the executive, a module for each."""
