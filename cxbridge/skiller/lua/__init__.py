"""The Lua engine: skills in Lua 5.1, and their Python host."""
