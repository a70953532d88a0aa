-- Small modules of Fawkes that skills require: transforms of plain tables, centres of laser lines, triggers,
-- initializers of modules.

local core = ...
local log, library = core.include("log"), core.include("library")
local geometry, tf = core.include("geometry"), core.include("transforms")
local Time = core.include("time").Time

local utilities = {}

-- fawkes.tfutils

local tfutils = {}

local function transform_pose(name, pose, from, to)
    if not tf:can_transform(from, to, Time:new(0, 0)) then
        log.error("tfutils.%s: Transform from %s to %s unavailable", name, tostring(from), tostring(to))
        return nil
    end
    local out = geometry.StampedPose:new()
    tf:transform_pose(to, geometry.StampedPose:new(pose, Time:new(0, 0), from), out)
    return out
end

--- Transform {x, y, ori} between frames, and add the new `frame`; nil without a transform.
function tfutils.transform(position, from, to)
    local rotation = geometry.create_quaternion_from_yaw(position.ori)
    local pose = geometry.Pose:new(rotation, geometry.Vector3:new(position.x, position.y, 0))
    local result = transform_pose("transform", pose, from, to)
    if not result then return nil end
    local origin = result:getOrigin()
    return {x = origin:x(), y = origin:y(), ori = geometry.get_yaw(result), frame = to}
end

function tfutils.is_quaternion(value) return geometry.type_of(value):match("Quaternion$") ~= nil end

function tfutils.is_stamped_pose(value) return geometry.type_of(value):match("::StampedPose$") ~= nil end

function tfutils.is_pose(value) return geometry.type_of(value):match("::Pose$") ~= nil end

--- Transform {x, y, z, ori} with ori a quaternion or {x, y, z, w}, a Pose or a StampedPose. The result has the same
-- type, but for a Pose it is a StampedPose; nil without a transform, or for another type.
function tfutils.transform6D(position, from, to)
    if tfutils.is_stamped_pose(position) or tfutils.is_pose(position) then
        return transform_pose("transform6D", position, from, to)
    end
    if type(position) ~= "table" or type(position.ori) ~= "table" then
        log.error("tfutils.transform6D: invalid input data: %s", geometry.type_of(position))
        return nil
    end
    local ori, has_plain_ori = position.ori, not tfutils.is_quaternion(position.ori)
    if has_plain_ori then ori = geometry.Quaternion:new(ori.x, ori.y, ori.z, ori.w) end
    local pose = geometry.Pose:new(ori, geometry.Vector3:new(position.x, position.y, position.z))
    local result = transform_pose("transform6D", pose, from, to)
    if not result then return nil end
    local origin, q = result:getOrigin(), result:getRotation()
    return {
        x = origin:x(), y = origin:y(), z = origin:z(),
        ori = has_plain_ori and {x = q:x(), y = q:y(), z = q:z(), w = q:w()} or q,
    }
end

--- The age of the latest transform between two frames, in seconds.
function tfutils.tf_age(from, to)
    local transform = geometry.StampedTransform:new()
    tf:lookup_transform(from, to, transform)
    return Time:new() - transform.stamp
end

utilities.tfutils = tfutils

-- fawkes.laser-lines_utils

local lines = {}

--- The centre between the end points of a line, with the orientation of the bearing: from the robot towards the line.
function lines.laser_lines_center(a, b, bearing)
    return {x = (a.x + b.x) / 2, y = (a.y + b.y) / 2, ori = library.math.normalize_mirror_rad(bearing)}
end

--- The centre of a LaserLineInterface.
function lines.center(line)
    return lines.laser_lines_center({x = line:end_point_1(0), y = line:end_point_1(1)},
                                    {x = line:end_point_2(0), y = line:end_point_2(1)}, line:bearing())
end

--- The point at a distance before a centre, turned towards the centre.
function lines.point_in_front(center, distance)
    return {
        x = center.x - math.cos(center.ori) * distance, y = center.y - math.sin(center.ori) * distance,
        ori = library.math.normalize_mirror_rad(center.ori),
    }
end

utilities.lines = lines

-- fawkes.trigger

local TriggerManager = {}

function TriggerManager:new(manager)
    assert(manager and manager.name, "TriggerManager requires a table with a name as argument")
    self.__index = self
    manager.triggers = {}
    return setmetatable(manager, self)
end

function TriggerManager:add_trigger(event, func)
    self.triggers[event] = self.triggers[event] or {}
    table.insert(self.triggers[event], func)
end

function TriggerManager:remove_trigger(event, func)
    local list = self.triggers[event] or {}
    for i = #list, 1, -1 do
        if list[i] == func then table.remove(list, i) end
    end
end

--- Call the functions of an event with the event, the time and further arguments.
function TriggerManager:trigger(event, ...)
    local now = library.os.time()
    for _, func in ipairs(self.triggers[event] or {}) do func(event, now, ...) end
end

utilities.trigger = {TriggerManager = TriggerManager}

-- fawkes.depinit

local initializers = {}

utilities.depinit = {
    add_module_initializer = function(func) table.insert(initializers, func) end,
    init_module = function(module, into)
        for _, initialize in ipairs(initializers) do initialize(module, into) end
    end,
}

return utilities
