-- Results of host functions: true and values, or false and the text of an error, which becomes a Lua error.

local core = ...
local charge = core.charge

local function results(ok, ...)
    if not ok then error((...), 0) end
    return ...
end

return function(...)
    charge(20)
    return results(...)
end
