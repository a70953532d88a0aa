-- Predicate libraries: modules whose functions are predicates, read like fields. A predicate keeps its value for
-- the rest of the loop, unless the value is nil.

local core = ...
local interfaces = core.include("interfaces")

local predlib = {}
-- The libraries by the names of their modules. A library has its module, its predicates by name, and as dependencies
-- the interfaces of depends_interfaces by the names of their variables.
local libraries = {}

local function read_field(library, module, name)
    local dependency = library.dependencies[name]
    if dependency ~= nil then return dependency end
    -- As in Fawkes, a library without dependencies has nil in depends_interfaces; the name is not an unknown predicate.
    if type(name) == "string" and name:match("^depends_") then return nil end
    local predicate = library.predicates[name]
    assert(predicate, string.format("Predicate %s is not available in module %s", tostring(name), module._NAME))
    -- a predicate may return a second value: its value for the rest of the loop
    local value, for_the_rest_of_the_loop = predicate()
    if for_the_rest_of_the_loop ~= nil then
        rawset(module, name, for_the_rest_of_the_loop)
    else
        rawset(module, name, value)
    end
    return value
end

local function define(library, module, name, value)
    if type(value) ~= "function" or name == "setup" then
        rawset(module, name, value)
        if name == "depends_interfaces" then
            interfaces.inject({name = module._NAME, depends_interfaces = value}, library.dependencies)
        end
        return
    end
    -- the text of Fawkes, which has it for an empty name, too
    assert(type(name) == "string" and name ~= "", "Invalid predicate name, not a string")
    assert(not library.predicates[name], "Predicate " .. name .. " has already been defined")
    library.predicates[name] = value
end

--- For module(..., fawkes.predlib.module_init): functions that are defined from here on are predicates.
function predlib.module_init(module)
    assert(module._NAME, "predlib.module_init() can only be called for modules")
    assert(not libraries[module._NAME], "predlib " .. module._NAME .. " has already been registered")
    local library = {module = module, predicates = {}, dependencies = {}}
    libraries[module._NAME] = library
    rawset(module, "setup", function(parameters)
        if not rawget(module, "predparams") then rawset(module, "predparams", {}) end
        for key, value in pairs(parameters) do module.predparams[key] = value end
    end)
    setmetatable(module, {
        predicates = library.predicates,
        dependencies = library.dependencies,
        __index = function(_, name) return read_field(library, module, name) end,
        __newindex = function(_, name, value) define(library, module, name, value) end,
    })
end

--- The function of a predicate.
function predlib.get_predfunc(module, name)
    local metatable = assert(getmetatable(module), "No meta table found, not a predicate library?")
    assert(type(metatable.predicates) == "table",
           "Predicates table not found or not a table, not a predicate library?")
    return metatable.predicates[name]
end

--- Check that a module is a library; a library opens its interfaces itself.
function predlib.setup(module)
    if type(module) == "string" then module = core.require(module) end
    assert(getmetatable(module), "Predicate library not properly initialized using predlib.module_init")
end

--- Clear the values at the start of a loop.
function predlib.reset()
    for _, library in pairs(libraries) do
        for name in pairs(library.predicates) do rawset(library.module, name, nil) end
    end
end

return predlib
