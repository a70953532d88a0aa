-- The standard library for skills: copies of its tables, so that skills cannot change the engine's tables. The copies lack
-- the functions that load code, access files or processes, or inspect other functions.

local core = ...
local native, host = core.native, core.host
local time = core.include("time")

local library = {}

local function copy(original)
    local result = {}
    for key, value in pairs(original) do result[key] = value end
    return result
end

library.string, library.table, library.math = copy(native.string), copy(native.table), copy(native.math)

-- Random numbers come from the generator of the run, so that a run with the same seed repeats.
function library.math.random(low, high)
    if low == nil then return host.random() end
    if high == nil then low, high = 1, low end
    assert(low <= high, "bad argument to 'random' (interval is empty)")
    return low + math.floor(host.random() * (high - low + 1))
end

function library.math.randomseed(seed) host.randomseed(seed) end

-- All times are times of the run's clock.
local function now_or(value) return value or time.now_sec() end

library.os = {
    date = function(format, at) return native.os.date(format, now_or(at)) end,
    time = function(fields) return fields and native.os.time(fields) or time.now_sec() end,
    clock = function() return host.elapsed_usec() / 1000000 end,
    difftime = native.os.difftime,
    getenv = function(name) return core.include("checked")(host.getenv(name)) end,
}
-- As in Fawkes, skill strings and conditions in texts get different functions.
local os = library.os
library.sandbox_os = {date = os.date, getenv = os.getenv, time = os.time, difftime = os.difftime}
library.condition_os = {date = os.date, time = os.time, clock = os.clock, difftime = os.difftime}

-- The functions that Fawkes adds to string, table and math

function library.string.join(delimiter, values)
    local texts = {}
    for i, value in ipairs(values) do texts[i] = tostring(value) end
    return table.concat(texts, delimiter)
end

--- Split at a pattern, without an empty part at the start.
function library.string.split(text, delimiter)
    local pieces, from = {}, 1
    while true do
        local first, last = text:find(delimiter, from)
        if not first or last < first then break end
        if first > 1 then table.insert(pieces, text:sub(from, first - 1)) end
        from = last + 1
    end
    table.insert(pieces, text:sub(from))
    return pieces
end

function library.table.deepcopy(value)
    local copies = {}
    local function clone(original)
        if type(original) ~= "table" then return original end
        if copies[original] == nil then
            local result = {}
            copies[original] = result
            for key, item in pairs(original) do result[clone(key)] = clone(item) end
            setmetatable(result, getmetatable(original))
        end
        return copies[original]
    end
    return clone(value)
end

local mathext = library.math
mathext.nan = 0 / 0

function mathext.isnan(x) return x ~= x end

function mathext.sign(x) return x > 0 and 1 or x < 0 and -1 or 0 end

--- Round half away from zero.
function mathext.round(x) return x >= 0 and math.floor(x + 0.5) or math.ceil(x - 0.5) end

function mathext.vec_length(x, y) return math.sqrt(x * x + y * y) end

function mathext.cart2polar2d(x, y) return math.atan2(y, x), mathext.vec_length(x, y) end

function mathext.polar2cart2d(phi, distance) return distance * math.cos(phi), distance * math.sin(phi) end

--- Normalise an angle in radians to [-pi, pi].
function mathext.normalize_mirror_rad(angle) return angle - 2 * math.pi * mathext.round(angle / (2 * math.pi)) end

function mathext.angle_distance(a, b) return math.abs(mathext.normalize_mirror_rad(a - b)) end

--- Make a read-only view of a table.
function library.readonly(original)
    return setmetatable({}, {
        __index = original,
        __newindex = function(_, key) error("cannot change " .. tostring(key) .. " from a skill string", 2) end,
        __metatable = "locked",
    })
end

-- Functions of the base library: for skill strings those of the sandbox of Fawkes, for modules more

library.sandbox_functions = {
    assert = assert, error = error, ipairs = ipairs, next = next, pairs = pairs, select = select,
    tostring = tostring, type = type, unpack = unpack, xpcall = core.xpcall,
}
library.module_functions = copy(library.sandbox_functions)
for name, value in pairs {
    pcall = pcall, tonumber = tonumber, rawequal = rawequal, rawget = rawget, rawset = rawset,
    getmetatable = getmetatable, setmetatable = setmetatable,
} do
    library.module_functions[name] = value
end

return library
