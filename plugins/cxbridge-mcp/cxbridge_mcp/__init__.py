"""A Model Context Protocol server with tools for runs, agents and daemons. See docs/editors.md."""
