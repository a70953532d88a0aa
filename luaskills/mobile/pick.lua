module(..., skillenv.module_init)

name = "pick"
fsm = SkillHSM:new {name = name, start = "CHECK"}
depends_interfaces = {{v = "gripper", type = "GripperInterface", id = "Gripper"}}

documentation = [==[Stand-in for taking something: closes the gripper.

pick{what="cup", patience=5}

@param what     the object to take, for the log only
@param patience maximum duration in seconds; 5 unless given

Fails without a gripper, when the gripper is closed already, or when it does not close in time.
]==]

skillenv.skill_module(_M)

fsm:define_states {export_to = _M, closure = {gripper = gripper}, "CHECK", "CLOSE"}

fsm:add_transitions {
    {"CHECK", "FAILED", precond = "not gripper:has_writer()", error = "there is no gripper"},
    {"CHECK", "FAILED", precond = "gripper:gripper_state() == gripper.CLOSED", error = "the gripper is closed already"},
    {"CHECK", "CLOSE", cond = true},
    {"CLOSE", "FINAL", cond = "gripper:gripper_state() == gripper.CLOSED", desc = "closed"},
    -- CLOSE:init replaces this 5
    {"CLOSE", "FAILED", timeout = {time = 5, error = "the gripper does not close"}},
}

function CLOSE:init()
    self.timeout_time = fsm.vars.patience or 5
    print_info("pick %s", tostring(fsm.vars.what or "something"))
    gripper:msgq_enqueue_copy(gripper.CloseGripperMessage:new())
end
