-- Modules of skill spaces: module() and require() of Lua 5.1 for the skill folders only, and the modules of Fawkes that
-- skill files require, from parts of this engine.

local core = ...
local log, library, host = core.include("log"), core.include("library"), core.host
local interfaces, time = core.include("interfaces"), core.include("time")
local geometry, tf, features = core.include("geometry"), core.include("transforms"), core.include("features")

-- The functions of ("text"):name(). Skills cannot change these, but can add functions to their string table.
local methods = {}
for name, method in pairs(library.string) do methods[name] = method end
core.string_metatable.__index = setmetatable(methods, {__index = library.string})

local modules = {}
local loaded = {}

-- The globals of skill files
local world = {
    string = library.string, table = library.table, math = library.math, os = library.os,
    debug = {traceback = core.bounded_traceback}, _VERSION = _VERSION,
    logger = log.logger, config = core.include("config"), clock = time.Clock, blackboard = interfaces.blackboard,
    tf = tf, navgraph = features.navgraph, tolua = {type = geometry.type_of},
    fawkes = setmetatable({Time = time.Time, Clock = time.Clock, tf = geometry}, {
        __index = function(_, key)
            if type(key) == "string" and key:match("Interface$") then return interfaces.class(key) end
        end,
    }),
}
world._G = world
for name, value in pairs(library.module_functions) do world[name] = value end
log.register(world)

--- Add the globals that are functions or tables to a module, and the other fields that skills expect.
function modules.import_globals(module)
    for name, value in pairs(world) do
        if type(value) == "function" or type(value) == "table" then module[name] = value end
    end
    log.register(module)
    module.Time, module.Clock = time.Time, time.Clock
end

core.import_globals = modules.import_globals

--- Add all globals to a module.
local function import_everything(module)
    for name, value in pairs(world) do module[name] = value end
    log.register(module)
end

-- require() and module()

-- Make a module a global: a.b.c becomes the field c of the table in the field b of the global a.
local function place_global(name, module)
    local parent = world
    for part in name:gmatch("([^.]+)%.") do
        if type(rawget(parent, part)) ~= "table" then rawset(parent, part, {}) end
        parent = rawget(parent, part)
    end
    local last = name:match("([^.]+)$")
    if rawget(parent, last) == nil then rawset(parent, last, module) end
end

-- The main functions of skill files, and the modules that module() has made of the files.
local main_functions, made_modules = setmetatable({}, {__mode = "k"}), setmetatable({}, {__mode = "k"})

local function load_file(name)
    local text, label = core.include("checked")(host.find_module(name))
    if text:sub(1, 1) == "\27" then error(label .. ":1: precompiled Lua is not accepted", 0) end
    local chunk, problem = core.loadstring(text, "@" .. label)
    if not chunk then error(problem, 0) end
    core.setfenv(chunk, world)
    main_functions[chunk] = true
    return chunk
end

-- The mark of a module whose file is running
local LOADING = {}

--- Load a module once and return it.
function modules.require(name)
    assert(type(name) == "string", "bad argument to 'require' (a module's name expected)")
    if loaded[name] == LOADING then error("loop or previous error loading module '" .. name .. "'", 2) end
    if loaded[name] == nil then
        local chunk = load_file(name)
        loaded[name] = LOADING
        local result = chunk(name)
        if result ~= nil then loaded[name] = result end
        if loaded[name] == LOADING then loaded[name] = true end
    end
    return loaded[name]
end
world.require, core.require = modules.require, modules.require

--- Make the calling file a module, whose fields are the later globals of the file.
function world.module(name, ...)
    assert(type(name) == "string", "bad argument to 'module' (a module's name expected)")
    -- Only main functions of files get a new environment, because a skill could call this function from an engine function.
    local file = core.getinfo(2, "f").func
    assert(main_functions[file], "module() is for the main part of a skill file")
    local module = loaded[name]
    if type(module) ~= "table" or module == LOADING then
        module = {}
        module._M, module._NAME, module._PACKAGE = module, name, name:match("^(.*%.)") or ""
        loaded[name] = module
        place_global(name, module)
    end
    made_modules[module] = true
    core.setfenv(file, module)
    for _, option in ipairs {...} do option(module) end
end

--- The module of the file of the function at a level of the stack; nil if the file is not a module.
function core.calling_module(level)
    local frame = core.getinfo(level + 1, "f")
    local environment = frame and frame.func and core.getfenv(frame.func)
    return environment and made_modules[environment] and environment or nil
end

--- The innermost line of a skill file on the stack, as "LABEL:LINE: "; empty without a skill file.
function core.place_in_skill()
    local level, frame = 2, core.getinfo(2, "Sl")
    while frame and level < 40 do  -- a limit, because the stack of a recursive skill may be deep
        if frame.currentline > 0 and frame.source:sub(1, 1) == "@" and frame.source:sub(1, 10) ~= "@cxbridge/" then
            return frame.source:sub(2) .. ":" .. frame.currentline .. ": "
        end
        level = level + 1
        frame = core.getinfo(level, "Sl")
    end
    return ""
end

--- Compile the text of a condition, with the environment as its globals.
-- @return the function, or nil and the error
function core.compile_condition(text, environment)
    assert(type(text) == "string" and type(environment) == "table", "a text and its environment expected")
    local condition, problem = core.loadstring("return " .. text, "=condition '" .. text .. "'")
    if not condition then return nil, problem end
    return core.setfenv(condition, environment)
end

-- A file may add its own modules for require(), but may not replace other modules.
local loaded_view = setmetatable({}, {
    __index = loaded,
    __newindex = function(_, name, module)
        assert(loaded[name] == nil, "there is a module '" .. tostring(name) .. "' already")
        loaded[name] = module
    end,
    __metatable = "locked",
})

world.package = {
    loaded = loaded_view,
    seeall = function(module) setmetatable(module, {__index = world}) end,
}

-- Fawkes' modules

local function provide(name, module)
    loaded[name] = module
    place_global(name, module)
end

local machines, substates = core.include("hsm"), core.include("substates")
local FSM, JumpState = core.include("fsm"), core.include("jumpstate")
local SkillJumpState = core.include("skillstate")
local skillenv = core.include("skillenv")

-- Parents first, because a module's table contains its sub-modules.
provide("fawkes.fsm", {FSM = FSM, JumpState = JumpState, State = JumpState})
provide("fawkes.fsm.state", {State = JumpState})
provide("fawkes.fsm.jumpstate", {JumpState = JumpState})
provide("fawkes.fsm.subfsmjumpstate", {SubFSMJumpState = substates.SubFSMJumpState})
provide("fawkes.fsm.multi_subfsm_jumpstate", {MultiSubFSMJumpState = substates.MultiSubFSMJumpState})
provide("fawkes.fsm.skill_jumpstate", {SkillJumpState = SkillJumpState})
provide("fawkes.hsm", {HSM = machines.HSM, FSM = FSM, JumpState = JumpState})
provide("fawkes.modinit", {
    module_init = modules.import_globals, register_all = import_everything,
    register_global_funcs = function(module)
        for name, value in pairs(world) do
            if type(value) == "function" then module[name] = value end
        end
    end,
})
provide("fawkes.logprint", {
    init = function() end, register_print_funcs = log.register, print = log.values, printf = log.info,
    print_debug = log.debug, print_info = log.info, print_warn = log.warn, print_error = log.error,
})
local utilities = core.include("utilities")
provide("fawkes.predlib", core.include("predlib"))
provide("fawkes.tfutils", utilities.tfutils)
provide("fawkes.laser-lines_utils", utilities.lines)
provide("fawkes.trigger", utilities.trigger)
provide("fawkes.depinit", utilities.depinit)
provide("fawkes.mathext", library.math)
provide("fawkes.stringext", library.string)
provide("fawkes.tableext", library.table)
provide("skiller.skillenv", skillenv)
provide("skiller.skillhsm", {SkillHSM = machines.SkillHSM, JumpState = JumpState, SkillJumpState = SkillJumpState})
provide("skiller.skillstati", core.include("status"))
provide("skiller.subskill_jumpstate", {SubSkillJumpState = SkillJumpState})
-- Skill files require the packages of the C++ bindings, which define the table fawkes.
for _, package in ipairs {"utils", "config", "logging", "interface", "blackboard", "tf", "navgraph"} do
    loaded["fawkes" .. package] = world.fawkes
end
world.skillenv = skillenv
skillenv.gensandbox = core.include("sandbox")
world.WaitState = core.include("oldstyle").WaitState

-- In Fawkes, each interface type is a module: interfaces.SkillerInterface.
setmetatable(loaded, {__index = function(_, name)
    local type_name = type(name) == "string" and name:match("^interfaces%.(%w+Interface)$")
    return type_name and interfaces.class(type_name) or nil
end})

--- Set a global of all skill files.
function modules.set_global(name, value) world[name] = value end

return modules
