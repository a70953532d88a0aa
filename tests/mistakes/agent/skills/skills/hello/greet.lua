module(..., skillenv.module_init)

name = "greet"
fsm = SkillHSM:new{name=name, start="START"}
depends_skills = {}
depends_interfaces = {}
documentation = [==[Greets somebody.

Parameters:
name: who is greeted
]==]
skillenv.skill_module(_M)

fsm:define_states{ export_to=_M,
  {"START", JumpState},
}

fsm:add_transitions{
  {"START", "FINAL", cond=true, desc="done"},
}

function START:init()
  self.fsm.vars.text = "Hello " .. self.fsm.vars.name
end
