"""Looks into a Lua engine with all the power that skills must not have: what is reachable from where."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest

from cxbridge.skiller.lua import state

KERNEL = ("boot", "budget", "guard", "matcher", "modules", "runner")
"""The files of the engine that have power."""

# Runs the engine's boot, and keeps what boot takes away: the debug library, the names of C functions.
_SPY = """
local tools, natives = {natives = {}}, {}
for name, value in pairs(_G) do tools[name] = value end
for _, library in ipairs {"debug", "string", "table", "math", "os", "io", "coroutine", "package"} do
    tools[library] = {}
    for name, value in pairs(_G[library]) do
        tools[library][name] = value
        tools.natives[value] = library .. "." .. name
    end
end
for name, value in pairs(_G) do tools.natives[value] = tools.natives[value] or name end
tools.natives[pairs({})], tools.natives[ipairs({})] = "next", "ipairs"
tools.start, tools._G = _G, nil
local load, enter = loadstring, setfenv
tools.runner = (function(...) BOOT
end)(...)
local spied = {}
for name, value in tools.next, tools.runner do spied[name] = value end
function spied.spy(text, ...) return enter(tools.assert(load(text)), tools)(...) end
return spied
"""

# Everything that is reachable from roots: through keys, values, metatables, and, for functions outside of
# the kernel, upvalues and environments. Functions of the kernel are where skills' power ends.
_WALK = """
local kernel, roots = ...
local is_kernel = {}
for name in kernel:gmatch("%a+") do is_kernel["@cxbridge/" .. name .. ".lua"] = true end
local seen, queue, found = {}, {}, {}
local function visit(value, path)
    local kind = type(value)
    if value == nil or kind == "boolean" or kind == "number" or seen[value] then return end
    seen[value] = path
    queue[#queue + 1] = {value, path}
end
for _, root in ipairs(roots) do visit(root[1], root[2]) end
local function name_of(key) return type(key) == "string" and key or tostring(key) end
local at = 1
while queue[at] do
    local value, path = queue[at][1], queue[at][2]
    at = at + 1
    local kind = type(value)
    local entry = {kind = kind, path = path}
    if kind == "function" then
        local info = debug.getinfo(value, "S")
        if info.what == "C" then
            entry.kind, entry.name = "C", natives[value] or "unknown"
        elseif is_kernel[info.source] then
            entry.kind, entry.name = "gate", info.source:match("(%a+)%.lua") .. ":" .. info.linedefined
        else
            visit(debug.getfenv(value), path .. "<environment>")
            for i = 1, 255 do
                local name, upvalue = debug.getupvalue(value, i)
                if not name then break end
                visit(upvalue, path .. "<" .. name .. ">")
            end
        end
    elseif kind == "table" then
        for key, item in next, value do
            visit(key, path .. "[key]")
            visit(item, path .. "." .. name_of(key))
        end
    elseif kind == "string" then
        entry.text = value
    end
    if kind ~= "function" and kind ~= "string" then
        local metatable = debug.getmetatable(value)
        if kind == "userdata" then entry.name = tostring(metatable and metatable.__metatable) end
        visit(metatable, path .. "<metatable>")
    end
    found[#found + 1] = entry
end
return found, seen
"""

# The table of an engine's globals of skill files, and its core: found by their looks, from the runner on.
_FIND = """
local found, seen, queue = {}, {}, {runner}
while #queue > 0 do
    local value = table.remove(queue)
    local kind = type(value)
    if (kind == "table" or kind == "function") and not seen[value] then
        seen[value] = true
        if kind == "table" then
            if rawget(value, "_G") == value then found.world = value end
            if rawget(value, "sethook") and rawget(value, "host") then found.core = value end
            for key, item in next, value do
                queue[#queue + 1] = key
                queue[#queue + 1] = item
            end
        else
            for i = 1, 255 do
                local name, upvalue = debug.getupvalue(value, i)
                if not name then break end
                queue[#queue + 1] = upvalue
            end
        end
    end
end
found.kernel_globals = debug.getfenv(runner.run)
return found
"""


# What a skill string can lay hands on: every value that it sees, every field of it by every name there is,
# and whatever comes out when it is called, with odd arguments. The debug library is not used for it.
_ATTACK = """
local sandbox, names, everything, most_calls = ...
local seen, queue, order, calls = {}, {}, {}, 0
local function visit(value, path)
    local kind = type(value)
    local thing = kind == "table" or kind == "function" or kind == "userdata" or kind == "thread"
    if not thing or seen[value] then return end
    seen[value] = path
    queue[#queue + 1] = {value, path}
end
local function visit_all(path, ok, ...)
    for i = 1, select("#", ...) do visit((select(i, ...)), path) end
end
local function fields(value, path)
    if type(value) == "table" then
        for key, item in next, value do
            visit(key, path .. "[key]")
            visit(item, path .. "." .. tostring(key))
        end
    end
    for _, name in ipairs(names) do
        local ok, item = pcall(function() return value[name] end)
        if ok then visit(item, path .. "." .. name) end
    end
end
local odd = {
    0, -1, 2, 2^31, "Position3DInterface", "x", "%s%d", true, {}, {1, 2}, function(...) return ... end,
}
local function call(value, path, owner)
    local tries = {{}, {owner}}
    for _, a in ipairs(odd) do
        tries[#tries + 1] = {a}
        tries[#tries + 1] = {owner, a}
        for _, b in ipairs(odd) do tries[#tries + 1] = {owner, a, b} end
    end
    for _, arguments in ipairs(tries) do
        calls = calls + 1
        if calls > most_calls then return end
        visit_all(path .. "()", pcall(value, unpack(arguments, 1, 3)))
        for _, argument in ipairs(arguments) do visit(argument, path .. "(argument)") end
    end
end
for name, item in next, everything do visit(item, name) end
local at = 1
while queue[at] do
    local value, path = queue[at][1], queue[at][2]
    at = at + 1
    if type(value) ~= "function" then fields(value, path) end
    call(value, path, type(value) == "function" and everything[path:match("^(%a+)%.")] or nil)
end
return seen, calls
"""


_NAMES = """
local names = {}
for key in next, (...) do
    if type(key) == "string" and #key < 40 then names[#names + 1] = key end
end
return names
"""

_FIELDS = """
local table, names, fields = (...), select(2, ...), {}
for _, name in ipairs(names) do fields[name] = table[name] end
return fields
"""

_HELD = """
local seen, library = ...
local held = {}
for value, path in next, seen do
    local kind = type(value)
    if kind == "userdata" or kind == "thread" or kind == "table" and library[value] then
        held[path] = kind .. " " .. tostring(library[value])
    elseif kind == "function" and debug.getinfo(value, "S").what == "C" then
        held[path] = "C " .. tostring(natives[value])
    end
end
return held
"""


@contextmanager
def spying(**changed: tuple[str, str]) -> Iterator[None]:
    """Engines that are made meanwhile can be looked into, see :func:`spy`.

    :param changed: files of the engine, each with a text in it and what to put in its place.
    """
    sources = dict(state._sources())
    for name, (before, after) in changed.items():
        assert before in sources[name]
        sources[name] = sources[name].replace(before, after)
    sources["boot"] = _SPY.replace("BOOT", sources["boot"])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(state, "_sources", lambda: sources)
        yield


def spy(engine: Any) -> Callable[..., Any]:
    """Return what runs Lua with all libraries in an engine that was made while :func:`spying`."""
    run: Callable[..., Any] = engine._state.functions["spy"]
    return run


def attack(engine: Any, most_calls: int) -> tuple[dict[str, str], int, int]:
    """Do all that a skill string could do with what it sees.

    :returns: the things of skills and of the library that it got hold of, and functions of C; how many things
        it found, and how many calls it made.
    """
    run = spy(engine)
    parts = run(_FIND)
    _, library = run(_WALK, " ".join(KERNEL), run("return {{(...), 'world'}}", parts["world"]))
    sandbox = parts["world"]["skillenv"]["gensandbox"]()
    names = run(_NAMES, library)
    everything = run(_FIELDS, sandbox, names)
    seen, calls = run(_ATTACK, sandbox, names, everything, most_calls)
    held = run(_HELD, seen, library)
    return dict(held.items()), len(list(seen.keys())), int(calls)


@dataclass
class Reached:
    """What a walk came to: where each thing is, by what it is.

    :param native: C functions, by name.
    :param gates: functions of the kernel.
    :param objects: userdata and threads: what they say they are.
    :param texts: all strings.
    :param forbidden: tables of the kernel, and the globals that Lua started with.
    """

    native: dict[str, str] = field(default_factory=dict)
    gates: dict[str, str] = field(default_factory=dict)
    objects: dict[str, str] = field(default_factory=dict)
    texts: list[str] = field(default_factory=list)
    forbidden: dict[str, str] = field(default_factory=dict)
    size: int = 0


def walk(engine: Any, roots: str) -> Reached:
    """Walk from the values of a Lua expression over ``world``, the globals of skill files.

    :param roots: ``{{value, name}, ...}``.
    """
    run = spy(engine)
    reached = Reached()
    parts = run(_FIND)
    expression = run(f"return function(world) return {roots} end")
    found, seen = run(_WALK, " ".join(KERNEL), expression(parts["world"]))
    for entry in found.values():
        reached.size += 1
        kind, path, name = entry["kind"], entry["path"], entry["name"]
        if kind == "C":
            reached.native[name] = path
        elif kind == "gate":
            reached.gates[path] = name
        elif kind in ("userdata", "thread"):
            reached.objects[path] = f"{kind} {name}"
        elif kind == "string":
            reached.texts.append(entry["text"])
    core = parts["core"]
    kernel = {"core": core, "host": core["host"], "limits": core["limits"], "natives": core["native"]}
    kernel |= {"globals of the kernel": parts["kernel_globals"], "first globals": run("return start")}
    for name, table in kernel.items():
        assert table is not None
        if seen[table] is not None:
            reached.forbidden[name] = seen[table]
    return reached
