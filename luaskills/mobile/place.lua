module(..., skillenv.module_init)

name = "place"
fsm = SkillHSM:new {name = name, start = "CHECK"}
depends_interfaces = {{v = "gripper", type = "GripperInterface", id = "Gripper"}}

documentation = [==[Stand-in for putting something down: opens the gripper.

place{what="cup", patience=5}

@param what     the object to put down, for the log only
@param patience maximum duration in seconds; 5 unless given

Fails without a gripper, when the gripper is open already, or when it does not open in time.
]==]

skillenv.skill_module(_M)

fsm:define_states {export_to = _M, closure = {gripper = gripper}, "CHECK", "OPEN"}

fsm:add_transitions {
    {"CHECK", "FAILED", precond = "not gripper:has_writer()", error = "there is no gripper"},
    {"CHECK", "FAILED", precond = "gripper:gripper_state() == gripper.OPEN", error = "the gripper is open already"},
    {"CHECK", "OPEN", cond = true},
    {"OPEN", "FINAL", cond = "gripper:gripper_state() == gripper.OPEN", desc = "open"},
    -- OPEN:init replaces this 5
    {"OPEN", "FAILED", timeout = {time = 5, error = "the gripper does not open"}},
}

function OPEN:init()
    self.timeout_time = fsm.vars.patience or 5
    print_info("place %s", tostring(fsm.vars.what or "something"))
    gripper:msgq_enqueue_copy(gripper.OpenGripperMessage:new())
end
