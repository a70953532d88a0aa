-- Interfaces of the blackboard as Lua objects: i:f(), i:set_f(v), i.CONSTANT, i.XMessage:new(...), queues.
-- The host describes each type once; accessors of fields are made at their first use.

local core = ...
local log, checked, host = core.include("log"), core.include("checked"), core.host

local interfaces = {}

-- The host's handle of each open interface. An interface is a userdata, as with tolua, so that skills cannot change its
-- table.
local handles = setmetatable({}, {__mode = "k"})

local function handle_of(interface)
    return handles[interface] or error("not an open interface (called with '.' instead of ':'?)", 3)
end

-- Accessors of fields, for interfaces (get and set go to the host) and for messages (values in a table)

-- The operation and the field of a method's name: set_FIELD, maxlenof_FIELD, FIELD, or is_FIELD for a bool
local function find_accessor(fields, key)
    local operation, name = key:match("^(set)_(.+)$")
    if not operation then operation, name = key:match("^(maxlenof)_(.+)$") end
    if operation and fields[name] then return operation, name end
    if fields[key] then return "get", key end
    name = key:match("^is_(.+)$")
    if name and fields[name] and fields[name].type == "bool" then return "get", name end
end

local function make_accessor(fields, key, get, set)
    local operation, name = find_accessor(fields, key)
    if operation == "maxlenof" then
        return function() return fields[name].length end
    elseif operation == "get" then
        return function(self, index) return get(self, name, index) end
    elseif operation == "set" and fields[name].array then
        return function(self, index, value) set(self, name, value, index) end
    elseif operation == "set" then
        return function(self, value) set(self, name, value) end
    end
end

-- Messages

local function get_value(message, name, index)
    local value = message.__values[name]
    if index ~= nil and type(value) == "table" then return value[index + 1] end
    return value
end

local function set_value(message, name, value, index)
    if index == nil then
        message.__values[name] = value
    else
        local elements = message.__values[name] or {}
        elements[index + 1] = value
        message.__values[name] = elements
    end
end

local envelope_methods = {
    id = function(self) return self.__envelope.id or 0 end,
    type = function(self) return self.__type end,
    sender_thread_name = function(self) return self.__envelope.sender_thread_name or "" end,
}
for _, field in ipairs {"sender_id", "source_id"} do
    envelope_methods[field] = function(self)
        local serial = self.__envelope[field] or ""
        return {get_string = function() return serial end}
    end
end

local function make_message_class(schema)
    local class = {}
    local instance = {__index = function(_, key)
        local method = envelope_methods[key] or make_accessor(schema.fields, key, get_value, set_value)
        class[key] = method
        return method
    end}
    setmetatable(class, instance)
    local metatable = {__index = class}
    -- envelope: the ids of the message, its sender and its source, and the name of the sending thread
    local function wrap(values, envelope)
        return setmetatable({__type = schema.name, __values = values, __envelope = envelope}, metatable)
    end
    --- Make a message from the values of all fields, in order, or from none.
    function class:new(...)
        local values = {}
        for i, name in ipairs(schema.order) do values[name] = (select(i, ...)) end
        return wrap(values, {})
    end
    return class, wrap
end

-- Types

local function queue_methods(wrappers)
    local methods = {}
    function methods:msgq_enqueue(message)
        local id = checked(host.send(handle_of(self), message.__type, message.__values))
        message.__envelope.id = id
        return id
    end
    methods.msgq_enqueue_copy = methods.msgq_enqueue
    function methods:msgq_first()
        local name, values, envelope = checked(host.queue_first(handle_of(self)))
        return name and wrappers[name](values, envelope)
    end
    function methods:msgq_empty() return checked(host.queue_size(handle_of(self))) == 0 end
    function methods:msgq_size() return checked(host.queue_size(handle_of(self))) end
    function methods:msgq_pop() checked(host.queue_pop(handle_of(self))) end
    function methods:msgq_flush() checked(host.queue_flush(handle_of(self))) end
    function methods:msgq_remove(message)
        checked(host.queue_remove(handle_of(self), type(message) == "table" and message:id() or message))
    end
    -- These methods do nothing, because a single thread runs all Lua.
    function methods:msgq_lock() end
    function methods:msgq_try_lock() return true end
    function methods:msgq_unlock() end
    return methods
end

local function add_common_methods(methods, type_name)
    function methods:read() checked(host.read(handle_of(self))) end
    function methods:write() checked(host.write(handle_of(self))) end
    function methods:timestamp() return core.include("time").Time:new(0, checked(host.timestamp(handle_of(self)))) end
    function methods:serial()
        local text = checked(host.query(handle_of(self), "serial"))
        return {get_string = function() return text end}
    end
    function methods:oftype(name) return name == type_name end
    for _, property in ipairs {
        "has_writer", "num_readers", "changed", "refreshed", "is_writer", "type", "id", "uid", "mem_serial",
    } do
        methods[property] = function(self) return checked(host.query(handle_of(self), property)) end
    end
end

local function get_field(interface, name, index) return checked(host.get(handle_of(interface), name, index)) end

local function set_field(interface, name, value, index)
    checked(host.set(handle_of(interface), name, value, index))
end

local function make_class(type_name)
    local schema = checked(host.describe(type_name))
    local wrappers = {}
    local class = queue_methods(wrappers)
    add_common_methods(class, type_name)
    for name, value in pairs(schema.constants) do class[name] = value end
    for _, message in ipairs(schema.messages) do
        class[message.name], wrappers[message.name] = make_message_class(message)
    end
    function class:create_message(name) return self[name]:new() end
    setmetatable(class, {__index = function(_, key)
        local accessor = type(key) == "string" and make_accessor(schema.fields, key, get_field, set_field)
        if accessor then class[key] = accessor end
        return accessor or nil
    end})
    return class
end

-- A function that makes userdata with a read-only index, as with tolua
local function new_userdata_of(class)
    local prototype = core.newproxy(true)
    local metatable = getmetatable(prototype)
    metatable.__index, metatable.__metatable = class, "interface"
    return function() return core.newproxy(prototype) end
end

local classes = {}

--- Return the class of an interface type: its constants, messages and methods.
function interfaces.class(type_name)
    if not classes[type_name] then
        local class = make_class(type_name)
        classes[type_name] = {class = class, new_userdata = new_userdata_of(class)}
    end
    return classes[type_name].class
end

-- Opened interfaces, shared by all skills: for each uid at most a reader and a writer

local reading, writing = {}, {}

local function open(type_name, id, for_writing, shared)
    interfaces.class(type_name)
    local interface = classes[type_name].new_userdata()
    handles[interface] = checked(host.open(type_name, id, for_writing, shared))
    return interface
end

local function open_shared(type_name, id, for_writing)
    local opened, uid = for_writing and writing or reading, type_name .. "::" .. id
    if not opened[uid] then
        log.debug("Opening interface %s for %s", uid, for_writing and "writing" or "reading")
        opened[uid] = open(type_name, id, for_writing, true)
    end
    return opened[uid]
end

--- Open the interfaces that depends_interfaces of a module names.
-- @param variables the table that gets the interfaces, by the names of the variables in the module
function interfaces.inject(module, variables)
    local wanted = module.depends_interfaces or {}
    assert(type(wanted) == "table", "Type of dependencies not table")
    for _, entry in ipairs(wanted) do
        assert(type(entry) == "table", "Non-table element in interface dependencies")
        assert(entry.v, "Interface dependency of " .. module.name .. " does not have a variable name (v) field")
        for _, field in ipairs {"type", "id"} do
            assert(entry[field], string.format("Interface dependency '%s' of %s does not have a(n) %s field",
                                               entry.v, module.name, field))
        end
        variables[entry.v] = open_shared(entry.type, entry.id, entry.writing)
    end
end

--- Read the data of all interfaces of skills.
function interfaces.read_all()
    if next(reading) then checked(host.read_all()) end
end

--- Publish the interfaces that skills have changed.
function interfaces.write_changed()
    if next(writing) then checked(host.write_changed()) end
end

--- The object that Fawkes calls blackboard.
interfaces.blackboard = {
    open_for_reading = function(_, type_name, id) return open(type_name, id, false, false) end,
    open_for_writing = function(_, type_name, id) return open(type_name, id, true, false) end,
    close = function(_, interface) checked(host.close(handle_of(interface))) end,
    is_alive = function() return true end,
}

return interfaces
