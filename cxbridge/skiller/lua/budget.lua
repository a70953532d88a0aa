-- Bounds what a piece of Lua may compute. The unit is the VM instruction: the same on every machine and every
-- clock, so that a run that fits on one fits on all.

local core = ...
local sethook, traceback = core.sethook, core.traceback

local STEP = 1000
local remaining = 0
local exhausted = false

local budget = {}

-- Once exhausted, every further instruction raises again: a pcall may catch the error, but whatever runs after
-- it is stopped at its first instruction, up to the call that armed the budget.
local function refuse()
    error("endless loop? The limit of instructions in one loop is used up", 0)
end

local function exhaust()
    exhausted = true
    sethook(refuse, "", 1)
    refuse()
end

local function count()
    remaining = remaining - STEP
    if remaining < 0 then exhaust() end
end

--- Pay for work that the host does; its instructions are not counted.
function budget.charge(instructions)
    remaining = remaining - instructions
end

--- Call fn with a number of instructions to spend.
-- @return as pcall, but an error comes with its traceback; third, whether the budget was used up
function budget.run(instructions, fn)
    remaining, exhausted = instructions, false
    sethook(count, "", STEP)
    local ok, result = xpcall(fn, traceback)
    sethook()
    return ok, result, exhausted
end

return budget
