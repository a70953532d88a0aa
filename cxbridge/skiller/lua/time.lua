-- The run's clock for Lua: Fawkes' Time and Clock. Host times are microseconds since the epoch.

local core = ...
local now_usec = core.host.now_usec

local time = {}

function time.now_msec() return math.floor(now_usec() / 1000) end

function time.now_sec() return math.floor(now_usec() / 1000000) end

local Time = {}
Time.__index = Time

--- Time:new() is the present time, Time:new(sec, usec) another time, Time:new(other) a copy.
function Time:new(sec, usec)
    local us
    if type(sec) == "table" then
        us = sec.us
    elseif sec then
        us = sec * 1000000 + (usec or 0)
    else
        us = now_usec()
    end
    return setmetatable({us = us}, self)
end

function Time:in_sec() return self.us / 1000000 end

function Time:in_msec() return math.floor(self.us / 1000) end

function Time:in_usec() return self.us end

function Time:get_sec() return math.floor(self.us / 1000000) end

function Time:get_usec() return self.us % 1000000 end

function Time:is_zero() return self.us == 0 end

function Time:stamp()
    self.us = now_usec()
    return self
end

function Time:set_time(sec, usec)
    self.us = type(sec) == "table" and sec.us or sec * 1000000 + (usec or 0)
end

function Time:add(seconds) self.us = self.us + seconds * 1000000 end

local function microseconds(value) return type(value) == "table" and value.us or value * 1000000 end

-- The seconds between two times, or the time that is b seconds before a
function Time.__sub(a, b)
    if type(b) == "table" then return (a.us - b.us) / 1000000 end
    return Time:new(0, a.us - microseconds(b))
end

function Time.__add(a, b) return Time:new(0, microseconds(a) + microseconds(b)) end

function Time.__eq(a, b) return a.us == b.us end

function Time.__lt(a, b) return a.us < b.us end

function Time.__le(a, b) return a.us <= b.us end

function Time:__tostring() return string.format("%.6f", self.us / 1000000) end

local Clock = {}
Clock.__index = Clock

function Clock:instance() return Clock end

function Clock:now() return Time:new() end

function Clock:get_time(into) if into then return into:stamp() else return Time:new() end end

function Clock:elapsed(since) return (now_usec() - since.us) / 1000000 end

time.Time, time.Clock = Time, Clock

return time
