"""The Lua behaviour engine: Lua 5.1 files that know what a skill is, and the Python side that hosts them."""
