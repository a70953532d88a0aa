-- Bounds what a piece of Lua may compute. The unit is the VM instruction: the same on every machine and every
-- clock, so that a run that fits on one fits on all. Some instructions do a lot of work, though (string.rep):
-- therefore processor time is bounded, too, far above what a sane skill needs.

local core = ...
local sethook, getinfo, traceback = core.sethook, core.getinfo, core.traceback

local STEP = 1000
local processor_time, match = core.native.os.clock, core.native.string.match
local remaining, deadline = 0, 0
local exhausted, armed = false, false

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
        local at = getinfo(level, "Sl")
        if not at then return getinfo(4, "Sl") or getinfo(3, "Sl") end
        if at.currentline >= 0 and not match(at.short_src, "^cxbridge/") then return at end
        level = level + 1
    end
end

local function exhaust()
    local at = place()
    exhausted = string.format("%s:%d: endless loop? The limit of computation in one loop is used up",
                              at.short_src, at.currentline)
    sethook(refuse, "", 1)
    error(exhausted, 0)
end

local function count()
    remaining = remaining - STEP
    if (remaining < 0 or processor_time() > deadline) and getinfo(2, "f").func ~= budget.run then exhaust() end
end

--- Pay for work that the host does; its instructions are not counted.
function budget.charge(instructions)
    remaining = remaining - instructions
end

--- Pay in advance for what a C function may come to do; called by a function that a skill calls.
function budget.spend(instructions)
    remaining = remaining - instructions
    if armed and not exhausted and (remaining < 0 or instructions > STEP and processor_time() > deadline) then
        exhaust()
    end
end

--- Whether the error that is under way says that the budget is used up.
function budget.is_exhausted() return exhausted ~= false end

--- Call fn with a number of instructions and seconds of processor time to spend.
-- @return as pcall, but an error comes with its traceback
function budget.run(instructions, seconds, fn)
    remaining, deadline, exhausted, armed = instructions, processor_time() + seconds, false, true
    sethook(count, "", STEP)
    local ok, result = xpcall(fn, traceback)
    sethook()
    armed = false
    return ok, result
end

return budget
