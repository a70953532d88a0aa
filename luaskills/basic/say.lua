module(..., skillenv.module_init)

name = "say"
fsm = SkillHSM:new {name = name, start = "ORDER"}
depends_interfaces = {{v = "voice", type = "SpeechSynthInterface", id = "Flite"}}

documentation = [==[Say something.

say{text="Hello", wait=true}

@param text what to say (also as the only positional argument)
@param wait true: final when it has been said; otherwise as soon as it has been ordered

Fails when there is nobody to speak, no text, when another text takes the place of this one, or when nobody takes it.
]==]

skillenv.skill_module(_M)

-- The voice tells which order it works on by the id of the message and its text, and whether it is done by "final".
-- Ids count anew for each who orders: another client's order may have ours, and may be said before ours. What was
-- there before we ordered is not ours.
function is_ours()
    return voice:msgid() == fsm.vars.order and voice:text() == fsm.vars.ordered
        and voice:timestamp():in_usec() ~= fsm.vars.before
end

fsm:define_states {
    export_to = _M,
    closure = {voice = voice, is_ours = is_ours},
    "ORDER", "QUEUED", "SILENCE", "LISTEN", "LOST",
}

fsm:add_transitions {
    {"ORDER", "FAILED", precond = "not voice:has_writer()", error = "there is no speech synthesis"},
    {"ORDER", "FAILED", precond = "not (vars.text or vars[1])", error = "no text given"},
    {"ORDER", "FINAL", cond = "not vars.wait", desc = "ordered"},
    {"ORDER", "QUEUED", cond = true, desc = "ordered, wait"},
    {"QUEUED", "FAILED", cond = "not voice:has_writer()", error = "the speech synthesis is gone"},
    {"QUEUED", "LISTEN", cond = "is_ours()", desc = "begun"},
    {"QUEUED", "SILENCE", cond = "voice:is_final()", desc = "nothing is said"},
    {"SILENCE", "LISTEN", cond = "is_ours()", desc = "begun"},
    {"SILENCE", "QUEUED", cond = "not (voice:has_writer() and voice:is_final())", desc = "another text comes first"},
    {"SILENCE", "LOST", timeout = 2, desc = "it stays so"},
    {"LOST", "FAILED", cond = true, error = "the order was lost"},
    {"LISTEN", "FAILED", cond = "not voice:has_writer()", error = "the speech synthesis is gone"},
    {"LISTEN", "FAILED", cond = "not is_ours()", error = "another text was spoken instead"},
    {"LISTEN", "FINAL", cond = "voice:is_final()", desc = "spoken"},
}

function ORDER:init()
    local text = tostring(fsm.vars.text or fsm.vars[1])
    local message = voice.SayMessage:new(text)
    fsm.vars.before = voice:timestamp():in_usec()
    fsm.vars.ordered = message:text() -- cut when it is too long
    fsm.vars.order = voice:msgq_enqueue_copy(message)
end
