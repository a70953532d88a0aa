module(..., skillenv.module_init)

name = "wait"
fsm = SkillHSM:new {name = name, start = "CHECK"}

documentation = [==[Do nothing for a while.

wait{seconds=2.5}

@param seconds the duration, a number that is not negative (also as the only positional argument)
]==]

skillenv.skill_module(_M)

function has_duration()
    local seconds = fsm.vars.seconds or fsm.vars[1]
    return type(seconds) == "number" and seconds >= 0
end

fsm:define_states {export_to = _M, closure = {has_duration = has_duration}, "CHECK", "WAIT"}

fsm:add_transitions {
    {"CHECK", "FAILED", precond = "not has_duration()", error = "seconds must be a number that is not negative"},
    {"CHECK", "WAIT", cond = true},
    {"WAIT", "FINAL", timeout = 1, desc = "time is up"}, -- WAIT:init replaces this 1
}

function WAIT:init() self.timeout_time = fsm.vars.seconds or fsm.vars[1] end
