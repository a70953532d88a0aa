"""Lua 5.1 as an oracle for the calls of a skill string.

Lua executes the text, so the text must contain only calls with constant arguments.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from cxbridge.skiller.lua.host import to_lua

# Executes a text whose functions only record their names and arguments, and returns the calls.
_COLLECT = """
local text = ...
local calls = {}
local function copy(value)
    if type(value) ~= "table" then return value end
    local result = {}
    for key, item in pairs(value) do result[key] = copy(item) end
    return result
end
local world = setmetatable({}, {__index = function(_, name)
    return function(...)
        local call = {name = name, count = select("#", ...)}
        for i = 1, call.count do call[i] = copy((select(i, ...))) end
        calls[#calls + 1] = call
    end
end})
setfenv(assert(loadstring(text)), world)()
return calls
"""


@cache
def _collector() -> Any:
    """Return the Lua function that executes a text and returns its calls."""
    from lupa.lua51 import LuaRuntime  # noqa: PLC0415 - only skill strings need Lua

    # latin-1, as in `to_lua`; the memory is far more than a skill string of 1000 bytes needs
    lua: Any = LuaRuntime(encoding="latin-1", max_memory=64 * 1024 * 1024)
    return lua.eval(f"function(...) {_COLLECT} end")


def lua_calls(text: str) -> list[tuple[str, Any]]:
    """Return the calls that Lua makes, as names and arguments in the form of :func:`normalise`."""
    calls = _collector()(to_lua(text))
    return [
        (call["name"], tuple(_plain(call[i]) for i in range(1, int(call["count"]) + 1)))
        for call in calls.values()
    ]


def _plain(value: Any) -> Any:
    """Return a value of Lua, with dictionaries for tables."""
    if hasattr(value, "items"):
        return {key: _plain(item) for key, item in value.items()}
    return value


def normalise(value: Any) -> Any:
    """Return a value, or the values of a call, in the form of Lua.

    A text has one character for each UTF-8 byte, and a table has no nil.
    """
    if isinstance(value, tuple):
        return tuple(normalise(item) for item in value)
    if isinstance(value, dict):
        return {normalise(key): normalise(item) for key, item in value.items() if item is not None}
    return to_lua(value) if isinstance(value, str) else value
