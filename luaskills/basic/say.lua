module(..., skillenv.module_init)

name = "say"
fsm = SkillHSM:new {name = name, start = "ORDER"}
depends_interfaces = {{v = "voice", type = "SpeechSynthInterface", id = "Flite"}}

documentation = [==[Say something.

say{text="Hello", wait=true}

@param text the text to say (also as the only positional argument)
@param wait true: final when the text has been said; otherwise as soon as the text has been ordered

Fails without a speech synthesis or a text, when another text is spoken instead, or when the order is lost.
]==]

skillenv.skill_module(_M)

-- The number of loops without speech after which the message counts as lost: 2 s at 30 loops a second.
local PATIENCE = 60

-- Return whether the state of the interface belongs to our message. The writer shows the id and the text of
-- the message in execution, and its end by "final". Ids are unique for each sender only: the message of
-- another client may have the same id, and may be spoken first. A state that was shown before our message does
-- not belong to our message.
function is_ours()
    return voice:msgid() == fsm.vars.message_id and voice:text() == fsm.vars.ordered_text
        and voice:timestamp():in_usec() ~= fsm.vars.time_before
end

fsm:define_states {
    export_to = _M,
    closure = {voice = voice, is_ours = is_ours, PATIENCE = PATIENCE},
    "ORDER", "LISTEN",
}

fsm:add_transitions {
    {"ORDER", "FAILED", precond = "not voice:has_writer()", error = "there is no speech synthesis"},
    {"ORDER", "FAILED", precond = "not (vars.text or vars[1])", error = "no text given"},
    {"ORDER", "FINAL", cond = "not vars.wait", desc = "ordered"},
    {"ORDER", "LISTEN", cond = true, desc = "ordered, wait"},
    {"LISTEN", "FAILED", cond = "not voice:has_writer()", error = "the speech synthesis is gone"},
    {"LISTEN", "FAILED", cond = "vars.begun and not is_ours()", error = "another text was spoken instead"},
    {"LISTEN", "FAILED", cond = "vars.silence > PATIENCE", error = "the order was lost"},
    {"LISTEN", "FINAL", cond = "is_ours() and voice:is_final()", desc = "spoken"},
}

function ORDER:init()
    local text = tostring(fsm.vars.text or fsm.vars[1])
    local message = voice.SayMessage:new(text)
    fsm.vars.time_before = voice:timestamp():in_usec()
    fsm.vars.ordered_text = message:text() -- truncated if too long
    fsm.vars.message_id = voice:msgq_enqueue_copy(message)
    fsm.vars.begun, fsm.vars.silence = false, 0
end

function LISTEN:loop()
    fsm.vars.begun = fsm.vars.begun or is_ours()
    fsm.vars.silence = voice:is_final() and fsm.vars.silence + 1 or 0
end
