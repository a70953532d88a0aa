module(..., skillenv.module_init)

name = "say"
fsm = SkillHSM:new {name = name, start = "ORDER"}
depends_interfaces = {{v = "voice", type = "SpeechSynthInterface", id = "Flite"}}

documentation = [==[Say something.

say{text="Hello", wait=true}

@param text what to say (also as the only positional argument)
@param wait true: final when it has been said; otherwise as soon as it has been ordered

Fails when there is nobody to speak, no text, or when another text takes the place of this one.
]==]

skillenv.skill_module(_M)

-- The voice tells which order it works on by the id of the message, and whether it is done by "final".
function has_spoken() return voice:msgid() == fsm.vars.order and voice:is_final() end

-- Ids count anew for each who orders: the one that was there before the order tells nothing.
function was_interrupted()
    return voice:msgid() > fsm.vars.order and voice:msgid() ~= fsm.vars.before
end

fsm:define_states {
    export_to = _M,
    closure = {voice = voice, has_spoken = has_spoken, was_interrupted = was_interrupted},
    "ORDER", "LISTEN",
}

fsm:add_transitions {
    {"ORDER", "FAILED", precond = "not voice:has_writer()", error = "there is no speech synthesis"},
    {"ORDER", "FAILED", precond = "not (vars.text or vars[1])", error = "no text given"},
    {"ORDER", "FINAL", cond = "not vars.wait", desc = "ordered"},
    {"ORDER", "LISTEN", cond = true, desc = "ordered, wait"},
    {"LISTEN", "FAILED", cond = "not voice:has_writer()", error = "the speech synthesis is gone"},
    {"LISTEN", "FAILED", cond = "was_interrupted()", error = "another text was spoken instead"},
    {"LISTEN", "FINAL", cond = "has_spoken()", desc = "spoken"},
}

function ORDER:init()
    local text = tostring(fsm.vars.text or fsm.vars[1])
    fsm.vars.before = voice:msgid()
    fsm.vars.order = voice:msgq_enqueue_copy(voice.SayMessage:new(text))
end
