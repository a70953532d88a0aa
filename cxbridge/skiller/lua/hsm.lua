-- State machines from definitions: HSM, and SkillHSM with its states FINAL and FAILED.

local core = ...
local log, FSM, JumpState = core.include("log"), core.include("fsm"), core.include("jumpstate")

local HSM = setmetatable({}, FSM)
HSM.__index = HSM

function HSM:new(definition)
    local hsm = FSM.new(self, definition)
    hsm.default_transitions = {}
    return hsm
end

function HSM:new_state() error("Only jump states can be created for a HSM") end

-- Add the missing default transitions to a state.
local function apply_defaults(hsm, state)
    if state.name == hsm.exit_state or state.name == hsm.fail_state then return end
    for i, default in ipairs(hsm.default_transitions) do
        local is_present = default.state == state.name
        for _, transition in ipairs(state.transitions) do
            is_present = is_present or transition.deftransindex == i
        end
        if not is_present then
            log.info("Adding transition %s -> %s (%s, %s)", state.name, default.state,
                     tostring(default.jumpcond), tostring(default.description or ""))
            local transition = state:add_new_transition(default.state, default.jumpcond, default.description)
            transition.deftransindex = i
        end
    end
end

function HSM:apply_default_transitions(state) apply_defaults(self, state) end

local function define_state(hsm, entry, closure)
    local definition = {}
    local name, class = entry, JumpState
    if type(entry) == "table" then
        name, class = entry[1], entry[2]
        for key, value in pairs(entry) do
            if key ~= 1 and key ~= 2 then definition[key] = value end
        end
    end
    local where = string.format("HSM[%s] ", hsm.name)
    assert(not hsm.states[name], where .. "state with name " .. tostring(name) .. " already defined")
    assert(class, where .. "class instance for state " .. tostring(name) .. " not defined")
    definition.name, definition.fsm, definition.closure = name, hsm, closure
    local state = class:new(definition)
    assert(JumpState.is_instance(state), "State class is not a sub-class of JumpState")
    hsm.states[name] = state
    apply_defaults(hsm, state)
end

--- Define states: "NAME" or {"NAME", Class, key=value...}. As in Fawkes, the table export_to gets the states by name, and
-- the names in the table closure are visible in conditions.
function HSM:define_states(states)
    self.states_defined = true
    for _, entry in ipairs(states) do define_state(self, entry, states.closure) end
    for name, state in pairs(self.states) do
        if states.export_to then states.export_to[name] = state end
    end
end

function HSM:new_jump_state(name, transitions, vars, export_to)
    assert(name, "HSM:new_jump_state: Name must be given")
    assert(self.states[name] == nil, "HSM:new_state: State with name " .. name .. " already exists")
    local definition = {name = name, fsm = self, transitions = transitions}
    for key, value in pairs(vars or {}) do definition[key] = value end
    local state = JumpState:new(definition)
    self.states_defined = true
    self.states[name] = state
    apply_defaults(self, state)
    if export_to then export_to[name] = state end
    return state
end

--- Add a transition to every state except its target, the exit state and the fail state, even to states that are
-- defined later.
function HSM:add_default_transition(target, condition, description)
    table.insert(self.default_transitions, {state = target, jumpcond = condition, description = description})
    for _, state in pairs(self.states) do apply_defaults(self, state) end
end

-- Transitions

local function find_state(hsm, name, role, label)
    return assert(hsm.states[name], string.format("%s state does not exist for transition %s", role, label))
end

local function add_timeout(hsm, from, to, entry, label)
    local spec = entry.timeout
    if type(spec) == "number" then spec = {time = spec} end
    assert(type(spec) == "table", "Timeout must be number or table")
    local target = spec.to or spec[2] or to.name
    assert(hsm.states[target], string.format("Timeout destination state %s does not exist for transition %s",
                                             tostring(target), label))
    from:set_timeout(spec.time or spec[1], target, spec.error, entry.desc)
end

local function conditions_of(entry, label)
    assert(not entry.precond_only, "The field 'precond_only' is not supported anymore! Use 'precond' instead")
    assert(not (entry[3] and entry.cond),
           "Only one of cond field and third index may be set as condition")
    local cond, precond = entry[3] or entry.cond, entry.precond
    if entry.cond_and_precond then
        assert(not (cond or precond),
               "When 'cond_and_precond' field is set, you may not set 'cond' or 'precond'")
        return entry.cond_and_precond, entry.cond_and_precond
    end
    if cond and precond == true then
        log.warn("ATTENTION: You have set the field 'cond' and set 'precond=true' for the transition %s. " ..
                     "The precondition always fires, so the condition is never tested.", label)
    end
    assert(cond or precond or entry.timeout,
           "You must have a condition or a timeout for transition " .. label)
    return cond, precond
end

local function add_between(hsm, entry)
    local label = tostring(entry[1]) .. " -> " .. tostring(entry[2])
    local from = find_state(hsm, entry[1], "Originating", label)
    local to = find_state(hsm, entry[2], "Destination", label)
    local cond, precond = conditions_of(entry, label)
    if entry.timeout then add_timeout(hsm, from, to, entry, label) end
    -- false for a missing transition, because ipairs ends at nil
    for _, added in ipairs {
        cond and from:add_new_transition(to, cond, entry.desc, entry.error) or false,
        precond and from:add_new_precondition(to, precond, entry.desc, entry.error) or false,
    } do
        if added then
            added.dotattr = entry.dotattr or added.dotattr
            added.hide = entry.hide and true or nil
        end
    end
end

--- Add transitions: {FROM, TO, cond...}, or a default transition {TO, cond=...}.
function HSM:add_transitions(transitions)
    if not self.states_defined then self:define_named_states(transitions) end
    for _, entry in ipairs(transitions) do
        if entry[2] then
            add_between(self, entry)
        else
            local to = find_state(self, entry[1], "Destination", "to " .. tostring(entry[1]))
            assert(entry.cond, "Default transition must have a jump condition")
            self:add_default_transition(to.name, entry.cond, entry.desc)
        end
    end
end

local SkillHSM = setmetatable({}, HSM)
SkillHSM.__index = SkillHSM

function SkillHSM:new(definition)
    local hsm = HSM.new(self, definition)
    if not hsm.no_default_states then
        hsm.exit_state, hsm.fail_state = "FINAL", "FAILED"
        hsm:define_states {export_to = hsm.export_to, "FINAL", "FAILED"}
        hsm.state_changed, hsm.states_defined = true, false
    end
    return hsm
end

core.include("oldstyle").extend(HSM)

return {HSM = HSM, SkillHSM = SkillHSM}
