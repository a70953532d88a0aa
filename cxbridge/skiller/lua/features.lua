-- The optional objects of a run; skills see nil for a missing object.

local core = ...

return {navgraph = core.host.nav_name and core.include("navgraph") or nil}
