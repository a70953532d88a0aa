"""The Lua behaviour engine: Lua 5.1 files that define skills, and the Python side that hosts them."""
