"""More planners: engines by unified-planning and programs; and the command ``plan``."""
