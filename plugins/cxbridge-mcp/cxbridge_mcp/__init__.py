"""A server of the Model Context Protocol: assistants look at runs, agents and daemons. docs/editors.md."""
