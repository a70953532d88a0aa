module(..., skillenv.module_init)

name = "fail"
fsm = SkillHSM:new {name = name, start = "CHECK"}

documentation = [==[Fail on purpose, to test how an agent handles the failure.

fail{after=1.5, error="out of paint", prob=0.3}

@param after seconds until the failure, a number that is not negative; 0 unless given
@param error the reason of the failure; "on purpose" unless given
@param prob  probability of the failure, from 0 to 1; otherwise the skill succeeds; 1 unless given
]==]

skillenv.skill_module(_M)

function is_number_between(value, low, high)
    return type(value) == "number" and value >= low and value <= high
end

function arguments_ok()
    return is_number_between(fsm.vars.after or 0, 0, math.huge) and
               is_number_between(fsm.vars.prob or 1, 0, 1)
end

-- Decide by a random number whether the skill fails; set the error of a failure.
function draw_failure()
    if math.random() >= (fsm.vars.prob or 1) then return false end
    fsm:set_error(tostring(fsm.vars.error or "on purpose"))
    return true
end

fsm:define_states {
    export_to = _M,
    closure = {arguments_ok = arguments_ok, draw_failure = draw_failure},
    "CHECK", "WAIT", "DECIDE",
}

fsm:add_transitions {
    {"CHECK", "FAILED", precond = "not arguments_ok()", error = "after must be a number from 0, and prob a number from 0 to 1"},
    {"CHECK", "WAIT", cond = true},
    {"WAIT", "DECIDE", timeout = 1, desc = "time is up"}, -- WAIT:init replaces this 1
    {"DECIDE", "FAILED", cond = draw_failure, desc = "on purpose"},
    {"DECIDE", "FINAL", cond = true, desc = "lucky"},
}

function WAIT:init() self.timeout_time = fsm.vars.after or 0 end
