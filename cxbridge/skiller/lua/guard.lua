-- C functions that can take long in one call, where no instruction is counted: what they may come to do is paid
-- for in advance, and a pattern that could run away is matched in Lua instead, where it is stopped.

local core = ...
local budget, matcher = core.include("budget"), core.include("matcher")
local native, native_table = core.native.string, core.native.table

local guard = {string = {}, table = {}, os = {}, base = {}}
core.kit.guard = guard

-- Steps of C for one instruction paid
local STEPS = 100
-- A C match that could take more steps than this is done in Lua; one whose steps only grow with the text gets more.
local LIMIT, LINEAR_LIMIT = 1e5, 2e7
-- C's matcher recurses with the length of the pattern, on a stack that has an end.
local LONGEST_PATTERN = 500
-- Of a C int
local LARGEST = 2 ^ 31 - 1
-- Values that a call may return, as C's stack has it
local MOST_RESULTS = 7000
local LONGEST_FORMAT = 1000
-- The year 9999: all that a date of four digits can show
local LAST_TIME = 253402300800
local UNBOUNDED = {["*"] = true, ["+"] = true, ["-"] = true}

-- How much C may have to do: the product of the choices at each item

local function study(pattern, from)
    local items = matcher.parse(pattern, from)
    local info = {items = #items, loops = 0, choices = 1, scans = false}
    local last = #items
    while last > 0 and (items[last].kind == "close" or items[last].kind == "position") do last = last - 1 end
    for i, item in ipairs(items) do
        if item.quantifier == "?" then
            info.choices = info.choices * 2
        elseif UNBOUNDED[item.quantifier] and i ~= last then
            info.loops = info.loops + 1
        elseif item.kind == "balance" or item.kind == "back" or (item.quantifier == "*" or item.quantifier == "+")
            and info.loops > 0 then
            info.scans = true
        end
    end
    return info
end

local studies, studied = {}, 0

local function study_of(pattern, anchored)
    local key = (anchored and "^" or " ") .. pattern
    if not studies[key] then
        if studied >= 1000 then studies, studied = {}, 0 end
        studies[key], studied = study(pattern, anchored and 2 or 1), studied + 1
    end
    return studies[key]
end

--- Whether C may match; if so it is paid for.
local function affordable(length, pattern, anchored)
    if #pattern > LONGEST_PATTERN then return false end
    local info = study_of(pattern, anchored)
    local power = info.loops + (anchored and 0 or 1) + (info.scans and 1 or 0)
    local steps = (length + 1) ^ power * info.choices * (info.items + 1)
    if steps > (power <= 1 and LINEAR_LIMIT or LIMIT) then return false end
    budget.spend(steps / STEPS)
    return true
end

-- A pattern of C ends at its first zero byte.
local function text_of(pattern) return native.match(pattern, "^[^%z]*") end

local function is_text(value) return type(value) == "string" or type(value) == "number" end

local function start_of(init, length)
    init = tonumber(init) or 1
    if init < 0 then init = init + length + 1 end
    return init < 1 and 1 or init > length + 1 and length + 1 or math.floor(init)
end

local function searcher(name)
    local in_c, in_lua = native[name], matcher[name]
    return function(subject, pattern, init, plain)
        if not is_text(subject) or not is_text(pattern) then return in_c(subject, pattern, init, plain) end
        subject, pattern = tostring(subject), tostring(pattern)
        if name == "find" and (plain or matcher.is_plain(pattern)) then
            budget.spend(#subject * (1 + #pattern / 16) / STEPS)
            return in_c(subject, pattern, init, true)
        end
        if affordable(#subject, pattern, native.sub(pattern, 1, 1) == "^") then
            return in_c(subject, pattern, init, plain)
        end
        return in_lua(subject, text_of(pattern), start_of(init, #subject))
    end
end

guard.string.find, guard.string.match = searcher("find"), searcher("match")

function guard.string.gmatch(subject, pattern)
    if not is_text(subject) or not is_text(pattern) then return native.gmatch(subject, pattern) end
    subject, pattern = tostring(subject), tostring(pattern)
    if affordable(#subject, pattern, false) then return native.gmatch(subject, pattern) end
    return matcher.gmatch(subject, text_of(pattern))
end
guard.string.gfind = guard.string.gmatch

function guard.string.gsub(subject, pattern, replacement, most)
    local kind = type(replacement)
    local usable = is_text(replacement) or kind == "table" or kind == "function"
    if not (is_text(subject) and is_text(pattern) and usable) then
        return native.gsub(subject, pattern, replacement, most)
    end
    subject, pattern = tostring(subject), tostring(pattern)
    if affordable(#subject, pattern, native.sub(pattern, 1, 1) == "^") then
        return native.gsub(subject, pattern, replacement, most)
    end
    return matcher.gsub(subject, text_of(pattern), replacement, most and tonumber(most) or #subject + 1)
end

--- C repeats even an empty text as often as the argument says.
function guard.string.rep(text, count)
    if is_text(text) and tonumber(count) then
        local size = #tostring(text) * count
        if size <= 0 then return "" end
        assert(size <= core.limits.largest_text, "string.rep: the resulting string would be too large")
        budget.spend(size * 5 / STEPS)
    end
    return native.rep(text, count)
end

-- Tables: elements that are moved, compared or joined

local function pay_for(list, factor)
    if type(list) == "table" then budget.spend(#list * factor / STEPS) end
end

function guard.table.insert(list, ...)
    if select("#", ...) > 1 then
        pay_for(list, 10)
        -- C moves all from the end down to the position, however far below the list that is.
        local position = tonumber((...))
        if type(list) == "table" and position and not (position >= 1 and position <= LARGEST) then
            error("bad argument #2 to 'insert' (position out of bounds)", 2)
        end
    end
    return native_table.insert(list, ...)
end

function guard.table.remove(list, ...)
    if select("#", ...) > 0 then pay_for(list, 10) end
    return native_table.remove(list, ...)
end

function guard.table.concat(list, separator, ...)
    pay_for(list, is_text(separator) and 5 + #tostring(separator) / 16 or 5)
    return native_table.concat(list, separator, ...)
end

for _, name in ipairs {"foreach", "foreachi", "getn", "maxn"} do
    local in_c = native_table[name]
    guard.table[name] = function(list, ...)
        pay_for(list, 5)
        return in_c(list, ...)
    end
end

function guard.table.sort(list, ...)
    pay_for(list, 200)
    return native_table.sort(list, ...)
end

-- Functions of the base library

local function in_bounds(number) return number > -LARGEST and number < LARGEST end

--- C puts as many values on its stack as the argument says, and counts them in an int that overflows.
function guard.base.unpack(list, from, to)
    local first, last = tonumber(from) or 1, tonumber(to) or type(list) == "table" and #list or 0
    if not (last - first < MOST_RESULTS and in_bounds(first) and in_bounds(last)) then
        error("too many results to unpack", 2)
    end
    return unpack(list, from, to)
end

--- Lua calls the handler of an xpcall where the error is raised. That the budget is used up is raised in a hook, and
-- in there no hook is called: a handler that loops would never be stopped. So handlers do not see this error.
function guard.base.xpcall(fn, handler)
    return xpcall(fn, function(problem)
        if budget.is_exhausted() then return problem end
        return handler(problem)
    end)
end

-- Dates: C asks the system for each item of a format, and takes any number for a time.

function guard.os.date(format, at)
    if format ~= nil and not is_text(format) or is_text(format) and #tostring(format) > LONGEST_FORMAT then
        error("bad argument #1 to 'date' (a short text expected)", 2)
    end
    local seconds = tonumber(at)
    if not (seconds and seconds > -LARGEST and seconds < LAST_TIME) then
        error("bad argument #2 to 'date' (a time expected)", 2)
    end
    return core.native.os.date(format, seconds)
end

function guard.os.time(fields)
    if type(fields) ~= "table" then error("bad argument #1 to 'time' (table expected)", 2) end
    local numbers = {isdst = fields.isdst}
    for _, name in ipairs {"year", "month", "day", "hour", "min", "sec"} do
        local number = tonumber(fields[name])
        if number and not in_bounds(number) then
            error("field '" .. name .. "' is out of bounds", 2)
        end
        numbers[name] = number
    end
    return core.native.os.time(numbers)
end

return guard
