-- Bounds what a piece of Lua may compute. The unit is the VM instruction: the same on every machine and every
-- clock, so that a run that fits on one fits on all. Some instructions do a lot of work, though (s .. s): therefore
-- processor time is bounded, too, far above what a sane skill needs.

local core = ...
local sethook, getinfo, collectgarbage = core.sethook, core.getinfo, core.collectgarbage
local limits = core.limits

-- Instructions between two looks at the budget, and such steps between two looks at the clock
local STEP, STEPS_TO_CLOCK = 100, 10
-- Large values take long to copy, in one instruction. So there are fewer instructions in a step once the memory has grown
-- so much in one, and the clock is looked at in each step once it has grown so much in all.
local FINE_STEP, LARGE_KIB, MUCH_KIB = 10, 32, 768
-- Of what a call gets that comes after one that used up everything: to reset skills, to tell why they failed.
local LEAST = 0.1
local LONGEST_MESSAGE = 4000
-- C walks through the whole stack for each function on it; of a stack deeper than this it shows only the top.
local DEEP, TOP = 200, 12

local processor_time, match, sub, format = core.native.os.clock, core.native.string.match, core.native.string.sub,
                                           core.native.string.format
local remaining, deadline, step, ticks, heap, much = 0, 0, STEP, 0, 0, 0
local exhausted, began = false, nil

local budget = {}

-- Once exhausted, every further instruction raises again: a pcall may catch the error, but whatever runs after
-- it is stopped at its first instruction, up to the call that armed the budget.
local function refuse()
    if getinfo(2, "f").func == budget.run then
        sethook()
    else
        error(exhausted, 0)
    end
end

-- The innermost place in a skill's code; the engine's own files tell a user nothing.
local function place()
    local level = 4
    while true do
        local at = level < DEEP and getinfo(level, "Sl")
        if not at then return getinfo(4, "Sl") or getinfo(3, "Sl") end
        if at.currentline >= 0 and not match(at.short_src, "^cxbridge/") then return at end
        level = level + 1
    end
end

local function exhaust()
    local at = place()
    exhausted = format("%s:%d: endless loop? The limit of computation in one loop is used up", at.short_src,
                       at.currentline)
    sethook(refuse, "", 1)
    error(exhausted, 0)
end

-- The clock is asked once there is something to measure: to ask takes longer than most calls do.
local function is_late()
    local now = processor_time()
    if not began then
        began, deadline = now, now + deadline
        return false
    end
    return now > deadline
end

local function count()
    remaining, ticks = remaining - step, ticks - 1
    if remaining >= 0 and step == STEP then
        local before = heap
        heap = collectgarbage("count")
        if heap - before > LARGE_KIB then
            step = FINE_STEP
            sethook(count, "", FINE_STEP)
        elseif ticks > 0 and heap < much then
            return
        end
    end
    if (remaining < 0 or is_late()) and getinfo(2, "f").func ~= budget.run then exhaust() end
    ticks = STEPS_TO_CLOCK
end

--- Pay for work that the host does; its instructions are not counted.
function core.charge(instructions)
    remaining = remaining - instructions
end

--- As Lua's xpcall. Lua calls the handler where the error is raised. The error of an exhausted budget is raised in a
-- hook, where no hook is called: a handler that loops would never be stopped. So handlers do not see this error.
function core.xpcall(fn, handler)
    return xpcall(fn, function(problem)
        if exhausted then return problem end
        return handler(problem)
    end)
end

--- What an error says. A value that is not a text is not converted to one: a skill's code would run, or a table go to the host.
local function text_of(problem)
    if type(problem) == "number" then problem = tostring(problem) end
    if type(problem) ~= "string" then return "(an error that is not a text but a " .. type(problem) .. ")" end
    return #problem > LONGEST_MESSAGE and sub(problem, 1, LONGEST_MESSAGE) or problem
end

--- debug.traceback(message, level), in bounded time.
local function traceback(message, level)
    if message ~= nil and type(message) ~= "string" and type(message) ~= "number" then return message end
    level = (tonumber(level) or 1) + 1
    if not getinfo(DEEP, "l") then return core.traceback(message, level) end
    local lines = {(message and message .. "\n" or "") .. "stack traceback:"}
    for i = level, level + TOP do
        local at = getinfo(i, "Sl")
        if at then lines[#lines + 1] = format("\t%s:%d: in a function", at.short_src, at.currentline) end
    end
    lines[#lines + 1] = "\t..."
    return table.concat(lines, "\n")
end
core.bounded_traceback = traceback

local function with_traceback(problem)
    return traceback(text_of(problem), 2)
end

-- xpcall of Lua 5.1 passes no arguments on.
local pending = {}
local function call_pending()
    return pending[1](pending[2], pending[3], pending[4], pending[5])
end

local left_instructions, left_seconds = limits.instructions_per_loop, limits.seconds_per_loop

--- Begin a loop: what runs from now on shares the budget of one loop.
function budget.renew()
    left_instructions, left_seconds = limits.instructions_per_loop, limits.seconds_per_loop
end

local function arm(instructions, seconds, fn, a, b, c, d)
    pending[1], pending[2], pending[3], pending[4], pending[5] = fn, a, b, c, d
    remaining, exhausted, step, ticks = instructions, false, STEP, STEPS_TO_CLOCK
    heap = collectgarbage("count")
    much = heap + MUCH_KIB
    deadline, began = seconds, nil
end

--- Call fn with up to four arguments and what is left of the loop's budget.
-- @return as pcall, but an error is a text with its traceback; three results at most
function budget.run(fn, a, b, c, d)
    local instructions = math.max(left_instructions, limits.instructions_per_loop * LEAST)
    local seconds = math.max(left_seconds, limits.seconds_per_loop * LEAST)
    arm(instructions, seconds, fn, a, b, c, d)
    sethook(count, "", STEP)
    local ok, first, second, third = xpcall(call_pending, with_traceback)
    sethook()
    left_instructions = left_instructions - (instructions - remaining)
    if began then left_seconds = left_seconds - (processor_time() - began) end
    if not ok then first = text_of(first) end
    return ok, first, second, third
end

--- As run, with the budget to load a skill space; later calls get a new one.
function budget.run_to_load(fn, a)
    left_instructions, left_seconds = limits.instructions_to_load, limits.seconds_to_load
    local ok, problem = budget.run(fn, a)
    budget.renew()
    return ok, problem
end

return budget
