module(..., skillenv.module_init)

name = "moveto"
fsm = SkillHSM:new {name = name, start = "CHECK"}

documentation = [==[Stand-in for driving to a place: waits for the duration of the drive.

moveto{place="kitchen", duration=2.0}

@param place      name of the place
@param duration   seconds of the drive; 1 unless given
@param error_prob probability that the robot does not arrive, from 0 to 1; 0 unless given
]==]

skillenv.skill_module(_M)

function got_lost() return math.random() < (fsm.vars.error_prob or 0) end

fsm:define_states {export_to = _M, closure = {got_lost = got_lost}, "CHECK", "DRIVE", "ARRIVE"}

fsm:add_transitions {
    {"CHECK", "FAILED", precond = "vars.place == nil", error = "no place given"},
    {"CHECK", "DRIVE", cond = true},
    {"DRIVE", "ARRIVE", timeout = 1, desc = "driving"}, -- DRIVE:init replaces this 1
    {"ARRIVE", "FAILED", cond = "got_lost()", error = "did not get there"},
    {"ARRIVE", "FINAL", cond = true, desc = "arrived"},
}

function DRIVE:init() self.timeout_time = fsm.vars.duration or 1 end
