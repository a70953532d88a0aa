-- Puts the engine together. Called once with the functions of the Python host and the texts of the other files;
-- returns what the host calls. Everything dangerous stays in locals here: no skill ever sees this environment.

local host, sources, limits = ...

local core = {
    host = host,
    limits = limits,
    loadstring = loadstring,
    setfenv = setfenv,
    getfenv = getfenv,
    newproxy = newproxy,
    traceback = debug.traceback,
    sethook = debug.sethook,
    getinfo = debug.getinfo,
    collectgarbage = collectgarbage,
    string_metatable = getmetatable(""),
    native = {string = string, table = table, math = math, os = os},
}

for _, name in ipairs {
    "io", "package", "python", "debug", "coroutine", "dofile", "load", "loadfile", "loadstring",
    "module", "require", "newproxy", "collectgarbage", "gcinfo", "getfenv", "setfenv", "print",
} do
    _G[name] = nil
end
string.dump = nil
core.string_metatable.__metatable = "locked"

--- Run one of the engine's own files, once, and return what it returns.
local included = {}
function core.include(name)
    if included[name] == nil then
        local chunk = assert(core.loadstring(sources[name], "@cxbridge/" .. name .. ".lua"))
        included[name] = chunk(core)
    end
    return included[name]
end

return core.include("runner")
