"""A Model Context Protocol server with tools for runs, agents and daemons.

An assistant is a program with a language model, such as the assistant of an editor, that calls the tools. See
docs/editors.md.
"""
