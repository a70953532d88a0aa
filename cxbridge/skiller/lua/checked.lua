-- Results of host functions: true and values, or false and the text of an error, which becomes a Lua error.

local core = ...
local charge = core.charge

-- Drop the leading true, or raise the error.
local function unwrap(ok, ...)
    if not ok then error((...), 0) end
    return ...
end

return function(...)
    charge(20) -- instructions of the budget: a rough price of a call into the host
    return unwrap(...)
end
