module(..., skillenv.module_init)

name = "goto_waypoints"
fsm = SkillHSM:new {name = name, start = "CHECK"}
depends_skills = {"goto_place"}

documentation = [==[Drive to places, one after the other.

goto_waypoints{places={"wp1", "wp2", "wp-final"}, patience=60}

@param places   names of the places, at least one
@param patience maximum duration of the drive to each place in seconds; no limit unless given

Fails at the first place that is not reached; the error names the place.
]==]

skillenv.skill_module(_M)

function has_places() return type(fsm.vars.places) == "table" and #fsm.vars.places > 0 end

function is_last() return fsm.vars.place_number >= #fsm.vars.places end

fsm:define_states {
    export_to = _M,
    closure = {has_places = has_places, is_last = is_last},
    "CHECK", "NEXT",
    {"DRIVE", SkillJumpState, skills = {{goto_place}}, final_to = "ARRIVED", fail_to = "FAILED"},
    "ARRIVED",
}

fsm:add_transitions {
    {"CHECK", "FAILED", precond = "not has_places()", error = "no places given"},
    {"CHECK", "NEXT", cond = true},
    {"NEXT", "DRIVE", cond = true},
    {"ARRIVED", "FINAL", cond = "is_last()", desc = "all reached"},
    {"ARRIVED", "NEXT", cond = true, desc = "go on"},
}

function NEXT:init() fsm.vars.place_number = (fsm.vars.place_number or 0) + 1 end

function DRIVE:init()
    self.args["goto_place"] = {place = fsm.vars.places[fsm.vars.place_number], patience = fsm.vars.patience}
end

-- When the drive has failed, put the place before its error.
function DRIVE:exit()
    local drive = goto_place.fsm
    if drive.current == drive.states[drive.fail_state] then
        fsm:set_error(string.format("%s: %s", tostring(fsm.vars.places[fsm.vars.place_number]), drive.error))
    end
end
