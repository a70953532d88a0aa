module(..., skillenv.module_init)

name = "relmoveto"
fsm = SkillHSM:new {name = name, start = "CHECK"}

documentation = [==[Stand-in for driving by a distance: waits for the duration of the drive.

relmoveto{x=1.0, y=0.5, ori=0.0, duration=2.0}

@param x          metres ahead
@param y          metres to the left
@param ori        radians to turn, counter-clockwise; 0 unless given
@param duration   seconds of the drive; 1 unless given
@param error_prob probability that the robot does not arrive, from 0 to 1; 0 unless given
]==]

skillenv.skill_module(_M)

function got_stuck() return math.random() < (fsm.vars.error_prob or 0) end

fsm:define_states {export_to = _M, closure = {got_stuck = got_stuck}, "CHECK", "DRIVE", "ARRIVE"}

fsm:add_transitions {
    {"CHECK", "FAILED", precond = "vars.x == nil or vars.y == nil", error = "x and y must be given"},
    {"CHECK", "DRIVE", cond = true},
    {"DRIVE", "ARRIVE", timeout = 1, desc = "driving"}, -- DRIVE:init replaces this 1
    {"ARRIVE", "FAILED", cond = "got_stuck()", error = "did not get there"},
    {"ARRIVE", "FINAL", cond = true, desc = "arrived"},
}

function DRIVE:init() self.timeout_time = fsm.vars.duration or 1 end
