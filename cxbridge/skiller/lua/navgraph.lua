-- The object navgraph of skills, in runs with a navigation graph.

local core = ...
local checked, host = core.include("checked"), core.host

local Node = {}
Node.__index = Node

local function node(name, x, y)
    return setmetatable({__name = name or "", __x = x or 0, __y = y or 0}, Node)
end

function Node:name() return self.__name end

function Node:x() return self.__x end

function Node:y() return self.__y end

function Node:is_valid() return self.__name ~= "" end

local function property(self, name) return checked(host.nav_property(self.__name, name)) end

function Node:has_property(name) return property(self, name) ~= nil end

for _, kind in ipairs {"float", "int", "bool"} do
    Node["property_as_" .. kind] = function(self, name)
        return checked(host.nav_convert(kind, property(self, name) or ""))
    end
end

--- A C++ vector as tolua shows it: its elements count from 0.
local function vector(list)
    list.size = function(self) return #self + (self[0] ~= nil and 1 or 0) end
    return list
end

function Node:reachable_nodes()
    local names = {checked(host.nav_reachable(self.__name))}
    local list = {}
    for i, name in ipairs(names) do list[i - 1] = name end
    return vector(list)
end

local navgraph = {}

function navgraph:name() return checked(host.nav_name()) end

function navgraph:node(name) return node(checked(host.nav_node(name))) end

local function nodes_of(...)
    local list = {}
    for i, name in ipairs {...} do list[i - 1] = navgraph:node(name) end
    return vector(list)
end

function navgraph:nodes() return nodes_of(checked(host.nav_search(""))) end

function navgraph:search_nodes(prop) return nodes_of(checked(host.nav_search(prop))) end

-- The last argument of nav_closest is the name of a node that is left out.
for suffix, unconnected in pairs {[""] = false, _with_unconnected = true} do
    navgraph["closest_node" .. suffix] = function(_, x, y, prop)
        return node(checked(host.nav_closest(x, y, prop or "", unconnected, "")))
    end
    navgraph["closest_node_to" .. suffix] = function(self, name, prop)
        local from = self:node(name)
        return node(checked(host.nav_closest(from:x(), from:y(), prop or "", unconnected, name)))
    end
end

function navgraph:default_property(name) return checked(host.nav_default(name)) or "" end

for _, kind in ipairs {"float", "int", "bool"} do
    navgraph["default_property_as_" .. kind] = function(self, name)
        return checked(host.nav_convert(kind, self:default_property(name)))
    end
end

--- Not in Fawkes: the nodes of the shortest way between two nodes, from index 1, and its length in metres.
-- nil without a way
function navgraph:search_path(from, to)
    local function collect(cost, ...)
        if not cost then return nil end
        local path = {}
        for i, name in ipairs {...} do path[i] = self:node(name) end
        return path, cost
    end
    return collect(checked(host.nav_path(from, to)))
end

return navgraph
