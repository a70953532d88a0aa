"""A server of the Model Context Protocol: assistants look at runs, agents and daemons. See docs/mcp.md."""
