-- The object that Fawkes calls config: values of the run's configuration by path.

local core = ...
local checked, host = core.include("checked"), core.host

local config = {}

--- Return a value for the functions below; an error names the line that has called the function.
local function read_value(path, kind)
    local ok, result = host.config_get(path, kind)
    core.charge(20) -- instructions of the budget: a rough price of a call into the host
    if not ok then error(result, 3) end
    return result
end

function config:exists(path) return checked(host.config_exists(path)) end

for _, kind in ipairs {"float", "uint", "int", "bool", "string"} do
    config["get_" .. kind] = function(_, path)
        local result = read_value(path, kind) -- no tail call, which would remove the calling line from the stack
        return result
    end
    config["is_" .. kind] = function(_, path) return checked(host.config_is(path, kind)) end
    config["get_" .. kind .. "_or_default"] = function(self, path, default)
        if not self:exists(path) then return default end
        local result = read_value(path, kind) -- no tail call, as above
        return result
    end
end

return config
