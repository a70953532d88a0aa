-- States with transitions that have conditions.
--
-- A transition is a table: state (target, or its name until prepare), jumpcond, description, error, place (in the
-- skill's file, of a condition that is a text), and pre or post: whether its condition is tested before the state's
-- init, or after init and in each loop.

local core = ...
local log, clock = core.include("log"), core.include("time")

local JumpState = {comment = ""}
JumpState.__index = JumpState

function JumpState:init() end
function JumpState:loop() end
function JumpState:exit() end
function JumpState:reset() self.last_trans = nil end

--- Make a state; definition needs name and fsm, and all its other keys become fields of the state.
function JumpState:new(definition)
    assert(definition, "JumpState requires a table as argument")
    assert(definition.name, "JumpState requires a name")
    assert(definition.fsm, "JumpState " .. definition.name .. " requires a FSM")
    self.__index = self
    for _, key in ipairs {"transitions", "loops", "inits", "dotattr"} do
        definition[key] = definition[key] or {}
        assert(type(definition[key]) == "table",
               string.format("%s: %s is not a table", definition.name, key))
    end
    return setmetatable(definition, self)
end

--- Whether a value is a state of this class or of a derived class.
function JumpState.is_instance(value)
    local class = getmetatable(value)
    while class do
        if class == JumpState then return true end
        class = getmetatable(class)
    end
    return false
end

-- Conditions

local visible_in_conditions = {
    string = core.include("library").string,
    math = core.include("library").math,
    table = core.include("library").table,
    os = core.include("library").condition_os,
    next = next, rawequal = rawequal, type = type,
}

local function compile(state, text)
    local env = {state = state, self = state, vars = state.fsm.vars, fsm = state.fsm}
    for name, value in pairs(visible_in_conditions) do env[name] = value end
    for name, value in pairs(state.closure or {}) do env[name] = value end
    local condition, problem = core.compile_condition(text, env)
    if not condition then
        error(string.format("%s: compiling jump condition '%s' failed: %s", state.name, text, problem), 0)
    end
    return condition
end

function JumpState:jumpcond_true() return true end

function JumpState:jumpcond_nowriter()
    for _, interface in ipairs(self.nowriter_interfaces or {}) do
        if not interface:has_writer() then return true end
    end
    return false
end

--- Make a transition without adding it.
function JumpState:create_transition(target, condition, description, message)
    local context = string.format(" while adding '%s'", tostring(description))
    assert(target, self.name .. ": Follow state is nil" .. context)
    assert(type(target) == "string" or target.name,
           self.name .. ": Follow state does not have a valid name" .. context)
    assert(condition ~= nil, self.name .. ": Jump condition is nil" .. context)
    local test = condition
    if type(condition) == "string" then
        test = compile(self, condition)
        description = description or condition
    elseif condition == true then
        test = JumpState.jumpcond_true
        description = description or "Unconditional"
    elseif condition == false then
        error(self.name .. ": adding a jump condition for false does not make any sense, it would never fire")
    elseif type(condition) ~= "function" then
        error(self.name .. ": type of jump condition must be function, string or boolean")
    end
    local place = type(condition) == "string" and core.place_in_skill() or nil
    return {state = target, jumpcond = test, description = description, error = message, place = place}
end

local function add(state, transition, phase)
    transition[phase] = true
    for _, known in ipairs(state.transitions) do
        if known == transition then return transition end
    end
    table.insert(state.transitions, transition)
    return transition
end

--- Add a transition that is tested after init and in each loop.
function JumpState:add_new_transition(...) return add(self, self:create_transition(...), "post") end

--- Add a transition that is tested before init.
function JumpState:add_new_precondition(...) return add(self, self:create_transition(...), "pre") end

--- Add a transition. With a condition, which is the old style, make and add a transition to the state in the
-- first argument.
function JumpState:add_transition(transition, condition, ...)
    if condition ~= nil then return self:add_new_transition(transition, condition, ...) end
    add(self, transition, "post")
end

function JumpState:add_precondition(transition) add(self, transition, "pre") end

function JumpState:clear_transitions() self.transitions = {} end

function JumpState:last_transition() return self.last_trans end

--- Return the transitions to a state (or its name), or all transitions.
-- As in Fawkes, a target that is still a name is found by get_transition, but not by this function.
function JumpState:get_transitions(target)
    local name = type(target) == "table" and target.name or target
    local matching = {}
    for _, transition in ipairs(self.transitions) do
        local to = type(transition.state) == "table" and transition.state.name
        if name == nil or to == name then table.insert(matching, transition) end
    end
    return matching
end

--- Return the only transition to a state (or its name); nil without a transition, an error for two transitions.
function JumpState:get_transition(target)
    local name = type(target) == "table" and target.name or target
    local matching
    for _, transition in ipairs(self.transitions) do
        local to = type(transition.state) == "table" and transition.state.name or transition.state
        if to == name then
            assert(not matching, "Two transitions to state " .. tostring(name))
            matching = transition
        end
    end
    return matching
end

-- Timeouts: a duration in seconds for each state, from its entry.

function JumpState:init_timeout() self.timeout_start = clock.now_msec() end

function JumpState:jumpcond_timeout()
    return clock.now_msec() - self.timeout_start >= math.floor(self.timeout_time * 1000)
end

function JumpState:set_timeout(seconds, target, message, description)
    assert(type(seconds) == "number", "Timeout value must be a number")
    assert(target, "No timeout target state given")
    self.timeout_time, self.timeout_to = seconds, target
    local label = "Timeout (" .. seconds .. " sec)"
    if description then label = label .. " [" .. tostring(description) .. "]" end
    table.insert(self.inits, self.init_timeout)
    self.timeout_transition = self:add_new_transition(target, self.jumpcond_timeout, label, message)
    self.timeout_transition.dotattr = {style = "dashed"}
end

-- Methods that the state machine calls

--- Replace the names of targets by states.
function JumpState:prepare()
    for _, transition in ipairs(self.transitions) do
        if type(transition.state) == "string" then
            local name = transition.state
            transition.state = self.fsm.states[name]
            assert(transition.state, "JumpState.prepare: failed to resolve forward declaration of state " ..
                       name .. ", no such state in FSM")
        end
    end
end

local function fire(state, transition)
    local fsm = state.fsm
    if transition.error then
        local before = fsm.error or ""
        fsm.error = (before ~= "" and before .. ", " or "") .. transition.error
    end
    state.last_trans = transition
    return transition.state
end

--- Return the target of the first transition whose condition is true; nil without such a transition.
-- @param before_init true to test the preconditions, else the conditions that are tested after init
function JumpState:try_transitions(before_init)
    local phase = before_init and "pre" or "post"
    for _, transition in ipairs(self.transitions) do
        if transition[phase] then
            self.tested_at = transition.place -- for the error of the condition, see call_protected in fsm.lua
            if transition.jumpcond(self) then return fire(self, transition) end
        end
    end
    self.tested_at = nil
    return nil
end

function JumpState:do_init()
    local target = self:try_transitions(true)
    if target then return target end
    self:init()
    for _, hook in ipairs(self.inits) do hook(self) end
    return self:try_transitions()
end

function JumpState:do_loop()
    self:loop()
    for _, hook in ipairs(self.loops) do hook(self) end
    return self:try_transitions()
end

function JumpState:do_exit() self:exit() end

return JumpState
