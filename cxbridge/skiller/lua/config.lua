-- The object that Fawkes calls config: values of the run's configuration by path.

local core = ...
local checked, host = core.include("checked"), core.host

local config = {}

function config:exists(path) return checked(host.config_exists(path)) end

for _, kind in ipairs {"float", "uint", "int", "bool", "string"} do
    config["get_" .. kind] = function(_, path) return checked(host.config_get(path, kind)) end
    config["is_" .. kind] = function(_, path) return checked(host.config_is(path, kind)) end
    config["get_" .. kind .. "_or_default"] = function(self, path, default)
        if not self:exists(path) then return default end
        return checked(host.config_get(path, kind))
    end
end

return config
