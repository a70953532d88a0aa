-- The budget of skills. The unit is the VM instruction, which is equal on all machines and clocks, so that a skill
-- within its budget on one machine is within its budget on all. Some instructions take long (s .. s), so processor time
-- has a limit, too, far above the needs of usual skills.

local core = ...
local sethook, getinfo, collectgarbage = core.sethook, core.getinfo, core.collectgarbage
local limits = core.limits

-- The number of instructions between two checks of the budget (a step), and of steps between two checks of the clock
local STEP, STEPS_TO_CLOCK = 100, 10
-- A single instruction may copy a large value. Therefore, once a step has grown the memory by more than LARGE_KIB, the
-- steps of the call have FINE_STEP instructions, and check the clock; all steps check the clock after a total growth by
-- MUCH_KIB.
local FINE_STEP, LARGE_KIB, MUCH_KIB = 10, 32, 768
-- The part of a loop's budget that each call gets at least, even after an exhausted budget: enough to reset skills and to
-- read the reasons of their failures.
local LEAST = 0.1
-- The maximum number of bytes of an error text; chosen freely, enough for a message and a traceback
local LONGEST_MESSAGE = 4000
-- Lua walks through the stack to find a function in it, so that a full traceback of a deep stack takes long: of a stack
-- of more than DEEP functions, a traceback shows only the innermost functions, as many as TOP says.
local DEEP, TOP = 200, 12

local processor_time, match, sub, format = core.native.os.clock, core.native.string.match, core.native.string.sub,
                                           core.native.string.format
-- The state of the present call:
--   remaining: the instructions that it may still execute
--   deadline: its end in processor time; before the first check of the clock, the seconds that it may take
--   step: the number of instructions between two checks of the budget
--   ticks: the number of checks of the budget until the next check of the clock
--   heap: the memory at the last check, in KiB
--   large_heap: the memory in KiB from which each check of the budget also checks the clock
local remaining, deadline, step, ticks, heap, large_heap = 0, 0, STEP, 0, 0, 0
-- The error of an exhausted budget, else false; and the processor time of the first check of the clock.
local exhausted, began = false, nil

local budget = {}

-- With an exhausted budget each further instruction raises the error again: a pcall may catch the error, but the code
-- after the pcall ends at its first instruction, up to the call that armed the budget.
local function refuse()
    -- level 1 is this hook, level 2 the interrupted function
    if getinfo(2, "f").func == budget.run then
        sethook()
    else
        error(exhausted, 0)
    end
end

-- The innermost frame of a skill's code, because lines of the engine's files do not help users.
local function find_frame()
    -- levels 1 to 3 are this function, exhaust and the hook, level 4 is the interrupted function
    local level = 4
    while true do
        local frame = level < DEEP and getinfo(level, "Sl")
        if not frame then return getinfo(4, "Sl") or getinfo(3, "Sl") end
        if frame.currentline >= 0 and not match(frame.short_src, "^cxbridge/") then return frame end
        level = level + 1
    end
end

local function exhaust()
    local frame = find_frame()
    exhausted = format("%s:%d: endless loop? The limit of computation in one loop is used up", frame.short_src,
                       frame.currentline)
    sethook(refuse, "", 1)
    error(exhausted, 0)
end

-- The first check of the clock is late, because a check takes longer than most calls.
local function is_late()
    local now = processor_time()
    if not began then
        began, deadline = now, now + deadline
        return false
    end
    return now > deadline
end

-- The hook: charges a step to the budget, and checks the clock when it is due.
local function count()
    remaining, ticks = remaining - step, ticks - 1
    if remaining >= 0 and step == STEP then
        local before = heap
        heap = collectgarbage("count")
        if heap - before > LARGE_KIB then
            step = FINE_STEP
            sethook(count, "", FINE_STEP)
        elseif ticks > 0 and heap < large_heap then
            return
        end
    end
    -- budget.run itself (level 2 is the interrupted function) must reach its end
    if (remaining < 0 or is_late()) and getinfo(2, "f").func ~= budget.run then exhaust() end
    ticks = STEPS_TO_CLOCK
end

--- Charge the budget for work of the host, whose instructions are not counted.
function core.charge(instructions)
    remaining = remaining - instructions
end

--- Lua's xpcall, but handlers do not get the error of an exhausted budget. Lua calls a handler at the place of the error,
-- which is here within a hook, where no hook is called: a handler with an endless loop would not end.
function core.xpcall(fn, handler)
    return xpcall(fn, function(problem)
        if exhausted then return problem end
        return handler(problem)
    end)
end

--- Return the text of an error. Other values are not converted to texts, because the conversion could run a skill's code.
local function text_of(problem)
    if type(problem) == "number" then problem = tostring(problem) end
    if type(problem) ~= "string" then return "(an error that is not a text but a " .. type(problem) .. ")" end
    return #problem > LONGEST_MESSAGE and sub(problem, 1, LONGEST_MESSAGE) or problem
end

--- debug.traceback(message, level) in bounded time.
local function traceback(message, level)
    if message ~= nil and type(message) ~= "string" and type(message) ~= "number" then return message end
    level = (tonumber(level) or 1) + 1
    if not getinfo(DEEP, "l") then return core.traceback(message, level) end
    local lines = {(message and message .. "\n" or "") .. "stack traceback:"}
    for i = level, level + TOP - 1 do
        local frame = getinfo(i, "Sl")
        if frame then lines[#lines + 1] = format("\t%s:%d: in a function", frame.short_src, frame.currentline) end
    end
    lines[#lines + 1] = "\t..."
    return table.concat(lines, "\n")
end
core.bounded_traceback = traceback

local function with_traceback(problem)
    return traceback(text_of(problem), 2)
end

-- The function and arguments of the present call, because xpcall of Lua 5.1 passes no arguments.
local pending = {}
local function call_pending()
    return pending[1](pending[2], pending[3], pending[4], pending[5])
end

-- The rest of the budget of the present loop
local left_instructions, left_seconds = limits.instructions_per_loop, limits.seconds_per_loop

--- Begin a loop: all calls until the next loop share a budget.
function budget.renew()
    left_instructions, left_seconds = limits.instructions_per_loop, limits.seconds_per_loop
end

local function arm(instructions, seconds, fn, a, b, c, d)
    pending[1], pending[2], pending[3], pending[4], pending[5] = fn, a, b, c, d
    remaining, exhausted, step, ticks = instructions, false, STEP, STEPS_TO_CLOCK
    heap = collectgarbage("count")
    large_heap = heap + MUCH_KIB
    deadline, began = seconds, nil
end

--- Call fn with up to four arguments and the rest of the loop's budget.
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

--- As run, with the budget for the loading of a skill space; later calls get a new budget.
function budget.run_to_load(fn, a)
    left_instructions, left_seconds = limits.instructions_to_load, limits.seconds_to_load
    local ok, problem = budget.run(fn, a)
    budget.renew()
    return ok, problem
end

return budget
