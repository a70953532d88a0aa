-- Puts the engine together. Called once with the functions of the Python host and the texts of the other files;
-- returns what the host calls.
--
-- There are two parts. The kernel (the files in KERNEL) has power: it loads code, sets environments, and counts
-- instructions. All other files are the library: what skills work with and may change. The library gets the kit: guarded
-- functions only. So whatever a skill reaches, and whatever it replaces there, leads to no power.
-- tests/skiller/lua/test_reach.py walks through all of it.

local host, sources, limits = ...

local KERNEL = {boot = true, budget = true, guard = true, matcher = true, modules = true, runner = true}

local newproxy, setfenv, getmetatable, assert, pairs = newproxy, setfenv, getmetatable, assert, pairs

local function copy(original)
    local result = {}
    for key, value in pairs(original) do result[key] = value end
    return result
end

-- The globals of the engine's own files: a table for each part, which no skill ever sees.
local function new_globals()
    return {
        assert = assert, error = error, getmetatable = getmetatable, ipairs = ipairs, next = next, pairs = pairs,
        pcall = pcall, rawequal = rawequal, rawget = rawget, rawset = rawset, select = select,
        setmetatable = setmetatable, tonumber = tonumber, tostring = tostring, type = type, unpack = unpack,
        xpcall = xpcall, _VERSION = _VERSION, string = copy(string), table = copy(table), math = copy(math),
    }
end

string.dump = nil

local core = {
    host = host, limits = limits,
    loadstring = loadstring, setfenv = setfenv, getfenv = getfenv,
    sethook = debug.sethook, getinfo = debug.getinfo, collectgarbage = collectgarbage,
    traceback = debug.traceback, string_metatable = getmetatable(""),
    native = {string = copy(string), table = copy(table), math = copy(math),
              os = {clock = os.clock, date = os.date, time = os.time, difftime = os.difftime}},
}
local globals = {kernel = new_globals(), library = new_globals()}

-- What the library gets instead of the core
local kit = {
    host = {},
    native = {string = core.native.string, table = core.native.table, math = core.native.math,
              os = {time = os.time, difftime = os.difftime}},
}
core.kit = kit

-- Nothing that could ever be found may lead out of here: neither the metatables of the host's objects and of strings,
-- nor the globals that Lua started with, nor the tables of the libraries.
core.string_metatable.__metatable = "locked"
getmetatable(host.log).__metatable = "locked"

core.string_metatable.__index = core.native.string
for _, library in pairs(copy(package.loaded)) do
    for name in pairs(copy(library)) do library[name] = nil end
end
setfenv(1, globals.kernel)

for name, call in pairs(host) do
    kit.host[name] = function(...) return call(...) end
end

--- What makes userdata with an index that nothing can be put into.
function kit.proxies(index)
    local prototype = newproxy(true)
    local metatable = getmetatable(prototype)
    metatable.__index, metatable.__metatable = index, "interface"
    return function() return newproxy(prototype) end
end

--- Run one of the engine's own files, once, and return what it returns.
local included = {}
function core.include(name)
    if included[name] == nil then
        local chunk = assert(core.loadstring(sources[name], "@cxbridge/" .. name .. ".lua"))
        setfenv(chunk, KERNEL[name] and globals.kernel or globals.library)
        included[name] = chunk(KERNEL[name] and core or kit)
    end
    return included[name]
end

function kit.include(name)
    assert(not KERNEL[name], "that file is not for the library")
    return core.include(name)
end

core.include("guard")
return core.include("runner")
