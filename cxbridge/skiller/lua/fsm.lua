-- Finite state machines: one loop() is one tick.

local core = ...
local log = core.include("log")
local traceback = core.traceback

local FSM = {debug = false}
FSM.__index = FSM

--- Make a state machine; definition needs name and start (the name of the first state).
function FSM:new(definition)
    assert(definition, "FSM requires a table as argument")
    assert(definition.name, "FSM requires a name")
    assert(definition.start, "FSM requires start state")
    assert(definition.debug == nil or type(definition.debug) == "boolean",
           "FSM debug value must be a boolean")
    self.__index = self
    -- max_num_traces and recursion_limit have the values of Fawkes
    local fresh = {
        vars = {}, persistent_vars = {}, states = {}, trace = {}, error = "", prepared = false,
        state_changed = false, tracing = true, max_num_traces = 40, recursion_limit = 10, current_recursion = 0,
        defined_at = core.place_in_skill(),
    }
    for key, value in pairs(fresh) do definition[key] = value end
    return setmetatable(definition, self)
end

function FSM.is_instance(value)
    local class = getmetatable(value)
    while class do
        if class == FSM then return true end
        class = getmetatable(class)
    end
    return false
end

-- Changes, and the trace

--- Whether the graph changed since the last call.
function FSM:changed()
    local changed = self.state_changed
    self.state_changed = false
    return changed
end

function FSM:mark_changed() self.state_changed = true end

function FSM:set_changed(changed) self.state_changed = changed == nil or changed end

function FSM:set_debug(debug) self.debug = debug end

--- Set the error text and log it; nil means no error.
function FSM:set_error(text)
    self.error = text
    if text and text ~= "" then log.warn("FSM %s: %s", self.name, text) end
end

local function select_trace_entries(fsm, is_selected)
    if not fsm.tracing then return false end
    local selected = {}
    for i, entry in ipairs(fsm.trace) do
        if is_selected(entry) then selected[i] = entry end
    end
    return next(selected) ~= nil, selected
end

--- Whether a state was left or entered, and its entries of the trace by index.
function FSM:traced_state(state)
    return select_trace_entries(self, function(entry) return entry.from == state or entry.to == state end)
end

--- Whether a transition was taken, and its entries of the trace by index.
function FSM:traced_trans(transition)
    return select_trace_entries(self, function(entry) return entry.transition == transition end)
end

--- Whether a state (or its name) was left or a transition was taken, and its entries of the trace by index.
function FSM:traced(subject)
    if type(subject) == "string" then subject = self.states[subject] end
    return select_trace_entries(self, function(entry)
        return entry.from == subject or entry.transition == subject
    end)
end

function FSM:reset_trace()
    self.trace = {}
    self.state_changed = true
end

function FSM:clear_states()
    self.states = {}
    self.state_changed = true
end

--- The graph of the machine in the dot language.
function FSM:graph() return core.include("graph").fsm(self) end

-- Ticks

local function call_protected(state, step)
    state.tested_at = nil
    return xpcall(function() return state[step](state) end, function(problem)
        -- The error of a condition that is written as a text gets the place of the condition's transition.
        if state.tested_at and type(problem) == "string" and string.find(problem, "condition '", 1, true) == 1 then
            problem = state.tested_at .. problem
        end
        return traceback(problem, 2)
    end)
end

local function note_transition(fsm, target)
    if fsm.tracing then
        -- As in Fawkes, a full trace replaces its newest entry.
        if #fsm.trace > fsm.max_num_traces then table.remove(fsm.trace) end
        table.insert(fsm.trace, {from = fsm.current, transition = fsm.current:last_transition(), to = target})
    end
    fsm.current_recursion = fsm.current_recursion + 1
    assert(fsm.current_recursion < fsm.recursion_limit,
           "Recursion limit (" .. fsm.recursion_limit .. ") reached, infinite loop?")
    fsm.state_changed = true
    if fsm.debug then
        log.debug("%s: Transition %s -> %s", fsm.name, fsm.current.name, target.name)
    end
end

--- Enter target, and further states as long as the entry of a state leads to a transition.
function FSM:trans(target)
    while target do
        note_transition(self, target)
        local left, problem = call_protected(self.current, "do_exit")
        if not left then self:set_error("Exit exception: " .. tostring(problem)) end
        self.previous, self.current = self.current, target
        local entered, result = call_protected(target, "do_init")
        if entered then
            target = result
        elseif target.name == self.fail_state then
            log.error("Failed to init fail state: %s", tostring(result))
            return
        else
            self:set_error("Init of successor failed: " .. tostring(result))
            target = self.states[self.fail_state]
        end
    end
end

local function start(fsm)
    fsm.current = fsm.states[fsm.start]
    if not fsm.current then error(fsm.defined_at .. "Start state " .. tostring(fsm.start) .. " does not exist", 0) end
    local entered, result = call_protected(fsm.current, "do_init")
    if entered then
        fsm:trans(result)
    else
        fsm.init_problem = "Init failed: " .. tostring(result)
        fsm:set_error(fsm.init_problem)
    end
    fsm.state_changed = true
end

-- A machine that fails without an error text gets the label of the transition to the fail state.
local function explain_failure(fsm)
    if (fsm.error or "") ~= "" or not fsm.previous then return end
    local last = fsm.previous:last_transition()
    fsm:set_error(last and last.description or
                      "reached fail state " .. fsm.fail_state .. " via unknown transition")
end

--- Run one tick: enter the start state if there is no current state, then loop the current state unless it is the fail
-- state.
function FSM:loop()
    self.current_recursion = 0
    if not self.current then start(self) end
    if self.current.name == self.fail_state then return explain_failure(self) end
    local looped, result = call_protected(self.current, "do_loop")
    if not looped then
        self:set_error("Loop exception: " .. tostring(result))
        result = self.states[self.fail_state]
    end
    self:trans(result)
end

--- Leave the current state and clear all variables except persistent_vars.
function FSM:reset()
    if self.current then self.current:do_exit() end
    for _, state in pairs(self.states) do state:reset() end
    -- Conditions in texts refer to this table, so it is emptied, not replaced.
    for name in pairs(self.vars) do self.vars[name] = nil end
    if not self.prepared then
        for _, state in pairs(self.states) do state:prepare() end
        self.prepared = true
    end
    self.trace, self.current, self.error, self.init_problem, self.state_changed = {}, nil, "", nil, true
    if self.debug then log.debug("FSM '%s' reset done", self.name) end
end

return FSM
