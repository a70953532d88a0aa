-- What a run may or may not have; skills see nil where it has not.

local core = ...

return {navgraph = core.host.nav_name and core.include("navgraph") or nil}
