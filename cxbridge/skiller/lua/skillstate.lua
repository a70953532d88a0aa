-- States that run other skills: in each loop those that still run, until all are final or one has failed.

local core = ...
local log, library, status = core.include("log"), core.include("library"), core.include("status")
local JumpState = core.include("jumpstate")

local SkillJumpState = setmetatable({}, JumpState)
SkillJumpState.__index = SkillJumpState

-- An entry of state.skills is {skill, table of arguments...}; resolve() replaces the name of a skill by its module.

local function join_names(state, separator)
    local list = {}
    for i, entry in ipairs(state.skills) do list[i] = entry[1].name end
    return table.concat(list, separator)
end

local function resolve(definition)
    assert(definition.skills, "No skills given")
    for _, entry in ipairs(definition.skills) do
        if type(entry[1]) == "string" then entry[1] = core.include("skillenv").get_skill_module(entry[1]) end
        assert(entry[1] ~= nil, "Skill entry is nil, forgot to add skill to dependencies?")
    end
end

-- The labels of the state's own transitions, which precede all other transitions.
function SkillJumpState:set_transition_labels()
    local has_skills = #self.skills > 0
    self.skill_names = join_names(self, ", ")
    if self.failure_transition then
        self.failure_transition.description = has_skills and join_names(self, " or ") .. " failed" or "Skills failed"
    end
    local outcome = self.failure_transition and " succeeded" or " done"
    self.final_transition.description = has_skills and join_names(self, " and ") .. outcome or "Skills succeeded"
    if has_skills then self.dotattr.comment = self.skill_names end
    self.fsm:mark_changed()
end

local function add_own_transition(state, target, condition, prefix, dotattr)
    local transition = state:add_new_transition(target, condition)
    local hide = state["hide_" .. prefix .. "_transition"] or false
    assert(type(hide) == "boolean", string.format("Hide %s transition for %s not a boolean", prefix, state.name))
    transition.hide = hide
    transition.dotattr = dotattr
    return transition
end

function SkillJumpState:new(definition)
    local name = tostring(definition.name)
    assert(definition.final_to, "SkillJumpState " .. name .. " requires final_to state")
    definition.fail_to = definition.fail_to or "FAILED"
    resolve(definition)
    local state = JumpState.new(self, definition)
    state.skill_status = status.S_RUNNING
    local has_one_target = state.final_to == state.fail_to
    state.final_transition = add_own_transition(
        state, state.final_to, has_one_target and self.jumpcond_skill_done or self.jumpcond_skill_final, "final",
        state.fintrans_dotattr)
    if not has_one_target then
        state.failure_transition = add_own_transition(
            state, state.fail_to, self.jumpcond_skill_failed, "failure", state.failtrans_dotattr)
    end
    state:set_transition_labels()
    return state
end

function SkillJumpState:jumpcond_skill_final() return self.skill_status == status.S_FINAL end

function SkillJumpState:jumpcond_skill_failed() return self.skill_status == status.S_FAILED end

function SkillJumpState:jumpcond_skill_done()
    return self:jumpcond_skill_final() or self:jumpcond_skill_failed()
end

--- Stop the skills and clear their arguments.
function SkillJumpState:skill_reset()
    for _, entry in ipairs(self.skills) do
        entry.__args, entry.status = nil, status.S_RUNNING
        entry[1].reset()
    end
end

-- Arguments: the tables in the definition, then the fields of self.args that init() has set.

local function defaults_of(entry)
    local args = {}
    for key, value in pairs(entry) do
        if type(key) == "number" and key > 1 and type(value) == "table" then
            for name, default in pairs(value) do args[name] = library.table.deepcopy(default) end
        elseif type(key) == "string" and key ~= "status" and key ~= "args" and key ~= "__args" then
            log.warn("You have set the subskill %s's field '%s'. Please pass its arguments in a table of their own.",
                     entry[1].name, key)
            args[key] = value
        end
    end
    return args
end

local function collect_arguments(state)
    for key in pairs(state.args) do
        if not state.expected[key] then log.warn("Unexpected skillname: %s in self.args", tostring(key)) end
    end
    for _, entry in ipairs(state.skills) do
        local args = defaults_of(entry)
        local overrides = state.args[entry[1]] or state.args[entry[1].name]
        if type(overrides) == "table" then
            for name, value in pairs(overrides) do args[name] = value end
        end
        entry.__args = args
    end
end

local function describe(entry)
    local texts = {}
    for name, value in pairs(entry.__args) do
        table.insert(texts, string.format("%s = %s", tostring(name), tostring(value)))
    end
    table.sort(texts)
    return entry[1].name .. "{" .. table.concat(texts, ", ") .. "}"
end

--- For derived classes, which can convert self.args after init().
function SkillJumpState:prepare_arguments() end

function SkillJumpState:do_init()
    local target = self:try_transitions(true) -- true: the transitions with preconditions
    if target then return target end
    self:skill_reset()
    self.skill_status = status.S_RUNNING
    self.args, self.expected = {}, {}
    for _, entry in ipairs(self.skills) do
        self.args[entry[1].name] = {}
        self.expected[entry[1].name] = true
    end
    self:init()
    self:prepare_arguments()
    collect_arguments(self)
    local calls = {}
    for i, entry in ipairs(self.skills) do calls[i] = describe(entry) end
    log.debug("%s: executing %s", self.name, table.concat(calls, "; "))
    for _, hook in ipairs(self.inits) do hook(self) end
    return self:try_transitions()
end

-- Run each running skill; the first failure ends the pass.
local function run_skills(state)
    local all_final = true
    for _, entry in ipairs(state.skills) do
        if entry.status == status.S_RUNNING then
            entry.status = entry[1](entry.__args)
            if entry.status == status.S_FAILED then return status.S_FAILED end
            if entry.status == status.S_RUNNING then all_final = false end
        end
    end
    return all_final and status.S_FINAL or status.S_RUNNING
end

function SkillJumpState:do_loop()
    self:loop()
    if self.skill_status == status.S_RUNNING then self.skill_status = run_skills(self) end
    for _, hook in ipairs(self.loops) do hook(self) end
    return self:try_transitions()
end

function SkillJumpState:do_exit()
    self:exit()
    self:skill_reset()
end

function SkillJumpState:reset()
    JumpState.reset(self)
    self:skill_reset()
    self.skill_status = status.S_INACTIVE
end

return SkillJumpState
