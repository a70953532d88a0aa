-- The skills of a skill space: loading, calling, their statuses.

local core = ...
local log, status = core.include("log"), core.include("status")
local interfaces, time = core.include("interfaces"), core.include("time")
local machines = core.include("hsm")

local skillenv = {}

-- The modules of the skills: in order of registration, and by the names of the skills
local skills, by_name = {}, {}
local exports = {
    SkillHSM = machines.SkillHSM,
    JumpState = core.include("jumpstate"),
    SkillJumpState = core.include("skillstate"),
    SubFSMJumpState = core.include("substates").SubFSMJumpState,
}

-- The names of the skills that the skill string has called in this loop, in order: separately for each
-- result, and all together
local names_by_result, active

--- Clear the calls of this loop.
function skillenv.reset_status()
    names_by_result = {running = {}, final = {}, failed = {}}
    active = {}
end
skillenv.reset_status()

local RESULT_NAMES = {
    [status.S_RUNNING] = "running", [status.S_FINAL] = "final", [status.S_FAILED] = "failed",
}

local function note_result(name, result)
    if type(result) ~= "number" then
        log.info("Skill %s did not return a valid final result.", name)
    elseif not RESULT_NAMES[result] then
        log.info("Skill %s returned an invalid skill status (%s)", name, tostring(result))
    else
        table.insert(names_by_result[RESULT_NAMES[result]], name)
    end
end

function skillenv.get_status() return #names_by_result.running, #names_by_result.final, #names_by_result.failed end

function skillenv.get_overall_status()
    if #names_by_result.failed > 0 then return status.S_FAILED end
    if #names_by_result.running > 0 then return status.S_RUNNING end
    return #names_by_result.final > 0 and status.S_FINAL or status.S_INACTIVE
end

--- The names of the skills called in this loop, in order.
function skillenv.get_active_skills() return unpack(active) end

--- The names of the failed skills of this loop.
function skillenv.get_failed_skills() return unpack(names_by_result.failed) end

function skillenv.get_skill_module(skill)
    if type(skill) == "string" then return by_name[skill] end
    -- as in Fawkes, a table with the function of a skill stands for the skill
    for _, module in ipairs(skills) do
        if module == skill or (type(skill) == "table" and rawequal(skill.wrapped_function, module.wrapped_function))
        then return module end
    end
end

function skillenv.get_skill_fsm(skill)
    local module = skillenv.get_skill_module(skill)
    return module and module.fsm
end

function skillenv.get_error()
    local texts = {}
    for _, name in ipairs(active) do
        local module = by_name[name]
        local text = module.fsm and module.fsm.error or module.errmsg or ""
        table.insert(texts, name .. ":" .. (text ~= "" and text or "ok"))
    end
    return table.concat(texts, " | ")
end

--- The names of all skills, in order of registration.
function skillenv.names()
    local list = {}
    for i, module in ipairs(skills) do list[i] = module.name end
    return list
end

function skillenv.modules() return skills end

-- Resets

local function reset_skill(name)
    local module = by_name[name]
    module.reset()
    for _, sub in ipairs(module.depends_skills or {}) do
        log.debug("Resetting sub-skill %s of skill %s", sub, name)
        by_name[sub].reset()
    end
end

function skillenv.reset_skills(list)
    for _, name in ipairs(list) do reset_skill(name) end
end

--- Reset the skills of the last loop.
function skillenv.reset_all()
    local before = names_by_result
    skillenv.reset_status()
    for _, list in ipairs {before.running, before.final, before.failed} do skillenv.reset_skills(list) end
end

-- Callbacks in each loop

local callbacks = {preloop = {}, loop = {}, finalize = {}}
skillenv.callbacks = callbacks
for kind, label in pairs {preloop = "Pre-Loop", loop = "Loop", finalize = "Finalize"} do
    skillenv["add_" .. kind .. "_callback"] = function(name, callback)
        assert(type(name) == "string", label .. " callback name must be a string")
        assert(type(callback) == "function", label .. " callback must be a function")
        callbacks[kind][name] = callback
    end
    skillenv["remove_" .. kind .. "_callback"] = function(name) callbacks[kind][name] = nil end
end

--- Run the callbacks of a kind in the order of their names.
function skillenv.run_callbacks(kind)
    local names = {}
    for name in pairs(callbacks[kind]) do table.insert(names, name) end
    table.sort(names)
    for _, name in ipairs(names) do callbacks[kind][name]() end
end

-- Calling skills

-- Only the first call after a reset sets the arguments.
local function take_arguments(vars, ...)
    if vars.__set__ then return end
    local first = ...
    if type(first) == "table" then
        for name, value in pairs(first) do vars[name] = value end
    else
        for i, value in ipairs {...} do vars[i] = value end
    end
    vars.__set__ = true
end

local function execute_fsm(fsm, ...)
    take_arguments(fsm.vars, ...)
    fsm:loop()
    local state_name = fsm.current.name
    if state_name == fsm.exit_state then return status.S_FINAL end
    if state_name == fsm.fail_state or (fsm.error or "") ~= "" then return status.S_FAILED end
    return status.S_RUNNING
end

local function call_from_skill_string(module, ...)
    table.insert(active, module.name)
    local results = {module.execute(...)}
    note_result(module.name, results[1])
    return unpack(results)
end

local function is_function(value) return type(value) == "function" end

local function check_runnable(module, module_name)
    if is_function(rawget(module, "execute")) and is_function(rawget(module, "reset")) then return end
    assert(module.fsm and module.fsm.exit_state,
           "Skill " .. module_name .. " does neither provide execute() function nor FSM with valid exit state")
    local fsm = module.fsm
    if not is_function(rawget(module, "execute")) then
        module.execute = function(...) return execute_fsm(fsm, ...) end
    end
    if not is_function(rawget(module, "reset")) then module.reset = function() fsm:reset() end end
end

--- Load a module and make its skill callable.
function skillenv.use_skill(module_name)
    local module = core.require(module_name)
    assert(type(module) == "table", "Skill module " .. module_name .. " is no module: its file is empty or lacks " ..
               "module(..., skillenv.module_init)")
    check_runnable(module, module_name)
    local metatable = assert(getmetatable(module),
                             "Skill module metatable not set, forgot to call skill_module() for skill " ..
                                 tostring(module.name))
    assert(by_name[module.name] == nil, "A skill with the name " .. module.name .. " already exists")
    metatable.__call = function(_, ...) return module.execute(...) end
    module.wrapped_function = function(_, ...) return call_from_skill_string(module, ...) end
    if is_function(rawget(module, "init")) then
        module.init()
    elseif module.fsm then
        module.fsm:reset()
    end
    table.insert(skills, module)
    by_name[module.name] = module
    log.info("Added skill %s", module.name)
end

-- Preparing modules

function skillenv.add_export(key, value) exports[key] = value end

--- For module(..., skillenv.module_init).
function skillenv.module_init(module)
    core.import_globals(module)
    for name, value in pairs(exports) do module[name] = value end
end

local function inject_skills(module, visible)
    local wanted = module.depends_skills or {}
    assert(type(wanted) == "table", "Type of depends_skills not table")
    for _, name in ipairs(wanted) do
        assert(type(name) == "string", "Type of element in depends_skills is not string")
        visible[name] = assert(by_name[name], "Skill " .. name .. " has not been added, dependencies for " ..
                                   module.name .. " cannot be met.")
    end
end

--- Check a skill's module, and make its interfaces, its sub-skills and the common names visible in it.
function skillenv.skill_module(module)
    if type(module) == "string" then module = core.require(module) end
    assert(type(module.name) == "string", "Skill name not set or not a string")
    assert(type(module.documentation) == "string", "Skill documentation missing or not a string")
    local metatable = getmetatable(module) or {}
    assert(metatable.__index == nil, "Module metatable already has an __index function/table.")
    assert(metatable.__call == nil, "Module metatable already has an __call function/table.")
    local visible = {
        logger = log.logger, config = core.include("config"), clock = time.Clock, tf = core.include("transforms"),
        __SKILLMODULE__ = true,
    }
    for name, value in pairs(status) do visible[name] = value end
    inject_skills(module, visible)
    interfaces.inject(module, visible)
    metatable.__index = visible
    setmetatable(module, metatable)
end

-- Skill strings

function skillenv.has_skill(name) return by_name[name] ~= nil end

--- Call a skill as a skill string does: its result counts for the overall status.
function skillenv.call_skill(name, ...) return call_from_skill_string(by_name[name], ...) end

local function copy_of(value)
    if type(value) ~= "table" then return value end
    local copy = {}
    for key, item in pairs(value) do copy[key] = copy_of(item) end
    return copy
end

--- Make calls {name=, count=, arguments...}. The arguments are new in each loop, as in a skill string that is run as Lua.
function skillenv.run_calls(calls)
    for _, call in ipairs(calls) do
        if call.count == 1 then -- the usual call, without a copy of the table of the call
            call_from_skill_string(by_name[call.name], copy_of(call[1]))
        else
            call_from_skill_string(by_name[call.name], unpack(copy_of(call), 1, call.count))
        end
    end
end

return skillenv
