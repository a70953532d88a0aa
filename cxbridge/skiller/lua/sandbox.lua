-- The globals of a skill string that is run as Lua (/skiller/mode: fawkes). Any client may send a skill string, so it gets
-- proxies instead of the tables of skills and of this engine. A proxy can be read and called; its values and results
-- are proxies again, and its arguments are copied. A skill string cannot assign to fields of a proxy, and its own
-- globals end with it.

local core = ...
local log, library, status = core.include("log"), core.include("library"), core.include("status")
local interfaces, time, skillenv = core.include("interfaces"), core.include("time"), core.include("skillenv")

-- The maximum depth of tables in each other, in an argument; chosen freely
local DEEPEST = 50

-- The object of a proxy, and the proxy of an object. The tables are weak: a proxy lives only as long as it is used.
local originals, proxies = setmetatable({}, {__mode = "k"}), setmetatable({}, {__mode = "kv"})

local proxy_for, call_original

--- An argument of a call: a copy of plain data, or the object of a proxy.
local function to_original(value, depth)
    local kind = type(value)
    if originals[value] ~= nil then return originals[value] end
    if kind == "table" then
        if depth >= DEEPEST then error("too many tables in each other", 0) end
        local copied = {}
        for key, item in next, value do copied[to_original(key, depth + 1)] = to_original(item, depth + 1) end
        return copied
    end
    if kind == "function" or kind == "userdata" then
        error("a skill string cannot pass a " .. kind .. " on", 0)
    end
    return value
end

local function convert_all(convert, count, ...)
    local values = {...}
    for i = 1, count do values[i] = convert(values[i], 0) end
    return unpack(values, 1, count)
end

local function to_originals(...) return convert_all(to_original, select("#", ...), ...) end

local function to_proxies(...) return convert_all(proxy_for, select("#", ...), ...) end

local function forward(operation)
    return function(a, b) return proxy_for(operation(to_original(a, 0), to_original(b, 0))) end
end

local metatable = {
    __index = function(proxy, key) return proxy_for(originals[proxy][key]) end,
    __newindex = function(_, key) error("cannot change " .. tostring(key) .. " from a skill string", 2) end,
    __call = function(proxy, ...) return call_original(originals[proxy], ...) end,
    __tostring = function(proxy) return tostring(originals[proxy]) end,
    __sub = forward(function(a, b) return a - b end), __add = forward(function(a, b) return a + b end),
    __eq = forward(function(a, b) return a == b end), __lt = forward(function(a, b) return a < b end),
    __le = forward(function(a, b) return a <= b end),
    __metatable = "locked",
}

function call_original(callee, ...) return to_proxies(callee(to_originals(...))) end

function proxy_for(value)
    local kind = type(value)
    if kind ~= "table" and kind ~= "function" and kind ~= "userdata" or originals[value] ~= nil then return value end
    if proxies[value] then return proxies[value] end
    local proxy
    if kind == "function" then
        proxy = function(...) return call_original(value, ...) end
    else
        proxy = setmetatable({}, metatable)
    end
    originals[proxy], proxies[value] = value, proxy
    return proxy
end

-- Skills: their names, documentation and calls

-- The name of each skill by the table that a skill string calls
local names = setmetatable({}, {__mode = "k"})

local function callable(name)
    local shown = {name = name, documentation = skillenv.get_skill_module(name).documentation}
    local made = setmetatable({}, {
        __call = function(_, ...) return to_proxies(skillenv.call_skill(name, to_originals(...))) end,
        __index = function(_, key) return shown[key] end,
        __newindex = function(_, key) error("cannot change " .. tostring(key) .. " of a skill from a skill string", 2) end,
        __metatable = "locked",
    })
    names[made] = name
    return made
end

local function show_info(skill)
    if skill == nil then
        log.info("Available skills:")
        for _, name in ipairs(skillenv.names()) do log.info(" %s", name) end
        return
    end
    local name = names[skill] or skill
    local module = type(name) == "string" and skillenv.get_skill_module(name)
    if not module then return log.info("The queried skill has not been registered") end
    log.values("Skill: " .. name)
    log.values(module.documentation)
end

local readonly = library.readonly

local function make_common()
    local common = {
        logger = proxy_for(log.logger), config = proxy_for(core.include("config")),
        clock = proxy_for(time.Clock), blackboard = proxy_for(interfaces.blackboard),
        tf = proxy_for(core.include("transforms")), navgraph = proxy_for(core.include("features").navgraph),
        math = readonly(library.math), string = readonly(library.string), table = readonly(library.table),
        os = readonly(library.sandbox_os),
        sinfo = show_info, skill_info = show_info,
    }
    log.register(common)
    common.print = log.info
    for name, value in pairs(library.sandbox_functions) do common[name] = value end
    for name, value in pairs(status) do common[name] = value end
    local list = {}
    for i, name in ipairs(skillenv.names()) do
        assert(common[name] == nil, "Sandbox: Name " .. name .. " has already been registered")
        list[i] = callable(name)
        common[name] = list[i]
    end
    common.skills = readonly(list)
    return common
end

-- The globals that all skill strings see, with the number of skills for which they were made
local shared

--- Make the globals of a skill string: a table of its own, which shows the shared globals until they are overridden.
return function()
    local skills = skillenv.names()
    if not shared or shared.count ~= #skills then shared = {count = #skills, visible = make_common()} end
    local visible = shared.visible
    return setmetatable({}, {__index = function(_, name) return visible[name] end, __metatable = "locked"})
end
