module(..., skillenv.module_init)

name = "goto_place"
fsm = SkillHSM:new {name = name, start = "CHECK"}
depends_interfaces = {{v = "navigator", type = "NavigatorInterface", id = "Navigator"}}

documentation = [==[Let the navigator drive to one of the places that it knows by name.

goto_place{place="wp1", ori=1.57, patience=60}

@param place    name of the place (also as the only positional argument)
@param ori      orientation at the place in radians; the navigator's choice unless given
@param patience maximum duration in seconds; no limit unless given

Fails without a place or a navigator, when the navigator fails, when it accepts the order of another client, when
it does not accept this order within a second, or after `patience`. When the skill is stopped on the way, or takes
too long, the robot stops, too.
]==]

skillenv.skill_module(_M)

local ERRORS = {
    [navigator.ERROR_MOTOR] = "the motor does not answer",
    [navigator.ERROR_OBSTRUCTION] = "the way is obstructed",
    [navigator.ERROR_UNKNOWN_PLACE] = "the navigator does not know the place",
    [navigator.ERROR_PATH_GEN_FAIL] = "there is no path",
}

-- Return whether the navigator has accepted our order. Message ids are unique for each sender only. If the id
-- before was equal to ours, it was that of another sender: only a navigator that moves has accepted ours.
function is_taken()
    return navigator:msgid() == fsm.vars.message_id
        and (fsm.vars.id_before ~= fsm.vars.message_id or not navigator:is_final())
end

-- Message id 0: the navigator has no order.
function is_ours() return navigator:msgid() == fsm.vars.message_id or navigator:msgid() == 0 end

function is_other() return not is_ours() and navigator:msgid() ~= fsm.vars.id_before end

-- Return whether the navigator reports an error; if so, set the error of the skill.
function has_failed()
    if not (navigator:is_final() and navigator:error_code() ~= navigator.ERROR_NONE) then return false end
    fsm:set_error(ERRORS[navigator:error_code()] or "error " .. navigator:error_code() .. " of the navigator")
    return true
end

function is_too_late()
    return fsm.vars.patience ~= nil and os.time() - fsm.vars.started >= fsm.vars.patience
end

fsm:define_states {
    export_to = _M,
    closure = {
        navigator = navigator, is_taken = is_taken, is_ours = is_ours, is_other = is_other,
        is_too_late = is_too_late,
    },
    "CHECK", "ORDER", "DRIVE",
}

fsm:add_transitions {
    {"CHECK", "FAILED", precond = "not navigator:has_writer()", error = "there is no navigator"},
    {"CHECK", "FAILED", precond = "type(vars.place or vars[1]) ~= 'string'", error = "no place given"},
    {"CHECK", "ORDER", cond = true},
    {"ORDER", "DRIVE", cond = "is_taken()", desc = "order taken"},
    {"ORDER", "FAILED", cond = "is_other()", error = "somebody else drives the robot"},
    {"ORDER", "FAILED", timeout = {time = 1, error = "the navigator does not answer"}},
    {"DRIVE", "FAILED", cond = "not navigator:has_writer()", error = "the navigator is gone"},
    {"DRIVE", "FAILED", cond = "is_other()", error = "somebody else drives the robot"},
    {"DRIVE", "FAILED", cond = has_failed, desc = "navigator failed"},
    {"DRIVE", "FINAL", cond = "is_ours() and navigator:is_final()", desc = "arrived"},
    {"DRIVE", "FAILED", cond = "is_too_late()", error = "it takes too long"},
}

function ORDER:init()
    local place, ori = fsm.vars.place or fsm.vars[1], fsm.vars.ori
    local message = ori and navigator.PlaceWithOriGotoMessage:new(place, ori) or
                        navigator.PlaceGotoMessage:new(place)
    fsm.vars.id_before, fsm.vars.started = navigator:msgid(), os.time()
    fsm.vars.message_id = navigator:msgq_enqueue_copy(message)
end

-- When the skill is stopped on the way or takes too long, stop the robot.
function DRIVE:exit()
    if navigator:has_writer() and is_ours() and not navigator:is_final() then
        navigator:msgq_enqueue_copy(navigator.StopMessage:new(fsm.vars.message_id))
    end
end
