-- Results of host functions: true and values, or false and the text of an error, which becomes a Lua error.

local core = ...
local charge = core.charge

-- Drop the leading true, or raise the error.
local function results(ok, ...)
    if not ok then error((...), 0) end
    return ...
end

return function(...)
    charge(20) -- for the work of the host
    return results(...)
end
