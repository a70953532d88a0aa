-- The object that Fawkes calls config: values of the run's configuration by path.

local core = ...
local checked, host = core.include("checked"), core.host

local config = {}

--- Get a value for one of the functions below; an error is told with the place that called that function.
local function value(path, kind)
    local ok, result = host.config_get(path, kind)
    core.charge(20)
    if not ok then error(result, 3) end
    return result
end

function config:exists(path) return checked(host.config_exists(path)) end

for _, kind in ipairs {"float", "uint", "int", "bool", "string"} do
    config["get_" .. kind] = function(_, path)
        local result = value(path, kind) -- no tail call: the place that called must stay on the stack
        return result
    end
    config["is_" .. kind] = function(_, path) return checked(host.config_is(path, kind)) end
    config["get_" .. kind .. "_or_default"] = function(self, path, default)
        if not self:exists(path) then return default end
        local result = value(path, kind)
        return result
    end
end

return config
