-- Builds the engine. The Python host calls this file once with its own functions, the texts of the other files and the
-- limits; the file returns the functions that the host calls.
--
-- The table of Lua's globals is emptied: skill files see only the globals of modules.lua, skill strings only
-- those of sandbox.lua.

local host, sources, limits = ...

-- this file needs these functions after it has emptied the table of globals
local setfenv, assert, pairs = setfenv, assert, pairs

local function copy(original)
    local result = {}
    for key, value in pairs(original) do result[key] = value end
    return result
end

string.dump = nil -- before the copies below: bytecode could leave the sandbox

-- The globals of the engine's files
local globals = {
    assert = assert, error = error, getmetatable = getmetatable, ipairs = ipairs, next = next, pairs = pairs,
    pcall = pcall, rawequal = rawequal, rawget = rawget, rawset = rawset, select = select,
    setmetatable = setmetatable, tonumber = tonumber, tostring = tostring, type = type, unpack = unpack,
    xpcall = xpcall, _VERSION = _VERSION, string = copy(string), table = copy(table), math = copy(math),
}

local core = {
    host = host, limits = limits,
    loadstring = loadstring, setfenv = setfenv, getfenv = getfenv, newproxy = newproxy,
    sethook = debug.sethook, getinfo = debug.getinfo, collectgarbage = collectgarbage,
    traceback = debug.traceback, string_metatable = getmetatable(""),
    native = {string = copy(string), table = copy(table), math = copy(math),
              os = {clock = os.clock, date = os.date, time = os.time, difftime = os.difftime}},
}

-- skills call methods of texts, as in ("x"):upper(), but must not replace them; the table string is emptied below
core.string_metatable.__metatable = "locked"
core.string_metatable.__index = core.native.string
-- all functions of the host share this metatable
getmetatable(host.log).__metatable = "locked"
for _, library in pairs(copy(package.loaded)) do
    for name in pairs(copy(library)) do library[name] = nil end
end
setfenv(1, globals)

--- Run a file of the engine once, and return its value.
local included = {}
function core.include(name)
    if included[name] == nil then
        local chunk = assert(core.loadstring(sources[name], "@cxbridge/" .. name .. ".lua"))
        included[name] = core.setfenv(chunk, globals)(core)
    end
    return included[name]
end

return core.include("runner")
