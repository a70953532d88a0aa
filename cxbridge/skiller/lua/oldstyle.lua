-- The old style of Fawkes' skill files, before define_states(): single states that are globals of the file, states that
-- run a skill, and states that wait. Today's Fawkes does not load such files.

local core = ...
local clock, log = core.include("time"), core.include("log")
local JumpState, SkillJumpState = core.include("jumpstate"), core.include("skillstate")

local oldstyle = {}

--- Make the states of a machine globals of the file of the function at a level of the stack.
local function export(fsm, level)
    local file = core.calling_module(level + 1)
    if not file then return end
    for name, state in pairs(fsm.states) do rawset(file, name, state) end
end

local function subclass(parent)
    local class = setmetatable({}, parent)
    class.__index = class
    return class
end

-- A state that waits for its field time_sec, or for the variable of that name.

local WaitState = subclass(JumpState)

function WaitState:new(definition)
    assert(definition.next_state, "WaitState " .. tostring(definition.name) .. " requires next_state")
    local state = JumpState.new(self, definition)
    local label = "Waited"
    if state.labeltime and state.time_sec then label = string.format("Waited %.1f sec", state.time_sec) end
    table.insert(state.inits, function() state.wait_start = clock.now_msec() end)
    state:add_new_transition(state.next_state, self.jumpcond_waited, label)
    return state
end

function WaitState:jumpcond_waited()
    local seconds = self.time_sec or self.fsm.vars.time_sec or 0
    return clock.now_msec() - self.wait_start >= seconds * 1000
end

-- A state that runs a skill with the arguments self.args.

local OneSkillState = subclass(SkillJumpState)

-- init() may have set the arguments in self.args itself instead of in the skill's table in self.args.
function OneSkillState:prepare_arguments()
    local skill = self.skills[1][1].name
    local args = self.args
    if args[skill] and next(args[skill]) == nil then args[skill] = nil end
    if next(args) ~= nil and not args[skill] then self.args = {[skill] = args} end
end

oldstyle.WaitState = WaitState

--- Add the methods of the old style to a class of machines.
function oldstyle.extend(HSM)
    local new_jump_state = HSM.new_jump_state

    --- new_jump_state(name), or with a skill, the targets after its final status and its failure, and its arguments.
    function HSM:new_jump_state(name, skill, final_to, fail_to, args)
        local state
        if type(skill) == "table" and skill.__SKILLMODULE__ then
            assert(not self.states[name], "State with name " .. tostring(name) .. " already exists")
            state = OneSkillState:new {
                name = name, fsm = self, skills = {{skill, args}}, final_to = final_to, fail_to = fail_to,
            }
            self:add_state(state)
        else
            -- not the old style: the arguments are name, transitions, vars and export_to
            local export_to = fail_to
            state = new_jump_state(self, name, skill, final_to, export_to)
            if export_to then return state end
        end
        export(self, 2)
        return state
    end

    function HSM:new_wait_state(name, next_state, definition)
        definition = definition or {}
        definition.name, definition.fsm, definition.next_state = name, self, next_state
        local state = self:add_state(WaitState:new(definition))
        export(self, 2)
        return state
    end

    function HSM:add_state(state)
        self.states_defined = true
        self.states[state.name] = state
        self:apply_default_transitions(state)
        export(self, 2)
        return state
    end

    --- Make the states that transitions name, for a file that does not define its states.
    function HSM:define_named_states(transitions)
        log.warn("%s: add_transitions() names states that define_states() did not define; they are made now",
                 self.name)
        for _, entry in ipairs(transitions) do
            for i = 1, 2 do
                local name = entry[i]
                if type(name) == "string" and not self.states[name] then
                    self:define_states {closure = transitions.closure, name}
                end
            end
        end
        export(self, 3)
    end
end

function JumpState:add_precond_trans(...) return self:add_new_precondition(...) end

return oldstyle
