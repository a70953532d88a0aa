-- States that run other machines: SubFSMJumpState runs a single machine, MultiSubFSMJumpState several machines at
-- once.

local core = ...
local JumpState = core.include("jumpstate")

local function subclass()
    local class = setmetatable({}, JumpState)
    class.__index = class
    return class
end

local function is_in_exit(fsm) return fsm.current and fsm.current.name == fsm.exit_state end

local function is_in_fail(fsm) return fsm.current and fsm.current.name == fsm.fail_state end

local SubFSMJumpState = subclass()

function SubFSMJumpState:new(definition)
    assert(definition.subfsm, "SubFSMJumpState " .. tostring(definition.name) .. " requires a sub-FSM")
    local state = JumpState.new(self, definition)
    if state.subfsm.exit_state and state.exit_to then
        state.final_transition =
            state:add_new_transition(state.exit_to, self.jumpcond_fsm_done, "FSM succeeded")
    end
    if state.subfsm.fail_state and state.fail_to then
        state.failure_transition =
            state:add_new_transition(state.fail_to, self.jumpcond_fsm_failed, "FSM failed")
    end
    return state
end

function SubFSMJumpState:jumpcond_fsm_done() return is_in_exit(self.subfsm) end

function SubFSMJumpState:jumpcond_fsm_failed() return is_in_fail(self.subfsm) end

-- The entry tests only preconditions, because the inner machine has not run yet.
function SubFSMJumpState:do_init()
    local target = self:try_transitions(true)
    if target then return target end
    self.subfsm:reset()
    self:init()
    for _, hook in ipairs(self.inits) do hook(self) end
    for name, value in pairs(self.fsm.vars) do self.subfsm.vars[name] = value end
end

function SubFSMJumpState:do_loop()
    self:loop()
    self.subfsm:loop()
    for _, hook in ipairs(self.loops) do hook(self) end
    if self.subfsm:changed() then self.fsm:mark_changed() end
    return self:try_transitions()
end

function SubFSMJumpState:do_exit()
    self:exit()
    if (self.subfsm.error or "") ~= "" then self.fsm.error = self.subfsm.error end
end

function SubFSMJumpState:reset()
    JumpState.reset(self)
    self.subfsm:reset()
end

local MultiSubFSMJumpState = subclass()

function MultiSubFSMJumpState:new(definition)
    local name = tostring(definition.name)
    assert(type(definition.subfsms) == "table" and next(definition.subfsms),
           "MultiSubFSMJumpState " .. name .. " requires sub-FSMs")
    for _, fsm in pairs(definition.subfsms) do
        assert(fsm.exit_state and fsm.fail_state,
               "MultiSubFSMJumpState " .. name .. ": each sub-FSM requires an exit and a fail state")
    end
    local state = JumpState.new(self, definition)
    if state.exit_to then
        state.final_transition =
            state:add_new_transition(state.exit_to, self.jumpcond_fsms_done, "FSMs succeeded")
    end
    if state.fail_to then
        state.failure_transition =
            state:add_new_transition(state.fail_to, self.jumpcond_fsms_failed, "FSM failed")
    end
    return state
end

function MultiSubFSMJumpState:jumpcond_fsms_done()
    for _, fsm in pairs(self.subfsms) do
        if not is_in_exit(fsm) then return false end
    end
    return true
end

function MultiSubFSMJumpState:jumpcond_fsms_failed()
    for _, fsm in pairs(self.subfsms) do
        if is_in_fail(fsm) then return true end
    end
    return false
end

function MultiSubFSMJumpState:do_init()
    local target = self:try_transitions(true)
    if target then return target end
    for _, fsm in pairs(self.subfsms) do fsm:reset() end
    self:init()
    for _, hook in ipairs(self.inits) do hook(self) end
    for name, fsm in pairs(self.subfsms) do
        for key, value in pairs(self.fsm.vars[name] or {}) do fsm.vars[key] = value end
    end
end

function MultiSubFSMJumpState:do_loop()
    self:loop()
    for _, fsm in pairs(self.subfsms) do
        if not is_in_exit(fsm) and not is_in_fail(fsm) then fsm:loop() end
        if fsm:changed() then self.fsm:mark_changed() end
    end
    for _, hook in ipairs(self.loops) do hook(self) end
    return self:try_transitions()
end

function MultiSubFSMJumpState:do_exit()
    self:exit()
    local errors = {}
    for name, fsm in pairs(self.subfsms) do
        if (fsm.error or "") ~= "" then table.insert(errors, name .. ": " .. fsm.error) end
    end
    table.sort(errors)
    if #errors > 0 then self.fsm.error = table.concat(errors, "|") end
end

function MultiSubFSMJumpState:reset()
    JumpState.reset(self)
    for _, fsm in pairs(self.subfsms) do fsm:reset() end
end

return {SubFSMJumpState = SubFSMJumpState, MultiSubFSMJumpState = MultiSubFSMJumpState}
