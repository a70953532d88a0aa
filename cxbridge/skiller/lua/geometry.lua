-- The types of fawkes.tf: vectors, quaternions, transforms and stamped values, with the methods that Fawkes exports to
-- Lua. Methods that return a new value do not change their operands; set..., normalize and mult change the object.

local core = ...
local Time = core.include("time").Time

local geometry = {}

local function make_class(type_name, parent)
    local class = setmetatable({}, {
        __index = parent,
        __call = function(self, ...) return self:new(...) end,
    })
    class.__index = class
    class.__type = "fawkes::tf::" .. type_name
    if parent then class.__mul, class.__eq = parent.__mul, parent.__eq end
    function class:new(...)
        local object = setmetatable({}, self)
        object:construct(...)
        return object
    end
    class.new_local = class.new
    geometry[type_name] = class
    return class
end

-- Vectors

local Vector3 = make_class("Vector3")

local function vector(x, y, z) return Vector3:new(x, y, z) end

function Vector3:construct(x, y, z)
    if type(x) == "table" then x, y, z = x[1], x[2], x[3] end
    self[1], self[2], self[3] = x or 0, y or 0, z or 0
end

function Vector3:x() return self[1] end

function Vector3:y() return self[2] end

function Vector3:z() return self[3] end

function Vector3:setX(x) self[1] = x end

function Vector3:setY(y) self[2] = y end

function Vector3:setZ(z) self[3] = z end

function Vector3:setValue(x, y, z) self[1], self[2], self[3] = x, y, z end

function Vector3:setZero() self:setValue(0, 0, 0) end

function Vector3:dot(v) return self[1] * v[1] + self[2] * v[2] + self[3] * v[3] end

function Vector3:length2() return self:dot(self) end

function Vector3:length() return math.sqrt(self:length2()) end

function Vector3:distance2(v) return vector(self[1] - v[1], self[2] - v[2], self[3] - v[3]):length2() end

function Vector3:distance(v) return math.sqrt(self:distance2(v)) end

function Vector3:isZero() return self[1] == 0 and self[2] == 0 and self[3] == 0 end

-- A length below 1e-15 is a few rounding errors of numbers near 1.
function Vector3:fuzzyZero() return self:length2() < 1e-30 end

function Vector3:normalized()
    local length = self:length()
    return vector(self[1] / length, self[2] / length, self[3] / length)
end

function Vector3:normalize()
    self:construct(self:normalized())
    return self
end

function Vector3:angle(v) return math.acos(self:dot(v) / math.sqrt(self:length2() * v:length2())) end

function Vector3:absolute() return vector(math.abs(self[1]), math.abs(self[2]), math.abs(self[3])) end

function Vector3:cross(v)
    return vector(self[2] * v[3] - self[3] * v[2], self[3] * v[1] - self[1] * v[3], self[1] * v[2] - self[2] * v[1])
end

function Vector3:triple(v1, v2) return self:dot(v1:cross(v2)) end

function Vector3:lerp(v, ratio)
    return vector(self[1] + (v[1] - self[1]) * ratio, self[2] + (v[2] - self[2]) * ratio,
                  self[3] + (v[3] - self[3]) * ratio)
end

function Vector3:setInterpolate3(v0, v1, ratio) self:construct(v0:lerp(v1, ratio)) end

-- Axes count from 0. Of equal axes, the last is the least and the first is the greatest, as in Fawkes.
function Vector3:minAxis()
    if self[1] < self[2] then return self[1] < self[3] and 0 or 2 end
    return self[2] < self[3] and 1 or 2
end

function Vector3:maxAxis()
    if self[1] < self[2] then return self[2] < self[3] and 2 or 1 end
    return self[1] < self[3] and 2 or 0
end

function Vector3:furthestAxis() return self:absolute():minAxis() end

function Vector3:closestAxis() return self:absolute():maxAxis() end

Vector3.__eq = function(a, b) return a[1] == b[1] and a[2] == b[2] and a[3] == b[3] end

make_class("Point", Vector3)

-- Rotations

local Quaternion = make_class("Quaternion")

--- Make a rotation from x, y, z, w; from yaw, pitch, roll; from an axis and an angle; or from another rotation.
-- Without arguments, all elements are 0.
function Quaternion:construct(x, y, z, w)
    if w then
        self:setValue(x, y, z, w)
    elseif type(x) == "table" and y then
        self:setRotation(x, y)
    elseif type(x) == "table" then
        self:setValue(x[1], x[2], x[3], x[4])
    elseif x then
        self:setEuler(x, y, z)
    else
        self:setValue(0, 0, 0, 0)
    end
end

function Quaternion:x() return self[1] end

function Quaternion:y() return self[2] end

function Quaternion:z() return self[3] end

function Quaternion:w() return self[4] end

function Quaternion:setX(x) self[1] = x end

function Quaternion:setY(y) self[2] = y end

function Quaternion:setZ(z) self[3] = z end

function Quaternion:setW(w) self[4] = w end

function Quaternion:setValue(x, y, z, w) self[1], self[2], self[3], self[4] = x, y, z, w end

function Quaternion:setRotation(axis, angle)
    local s = math.sin(angle / 2) / axis:length()
    self:setValue(axis[1] * s, axis[2] * s, axis[3] * s, math.cos(angle / 2))
end

function Quaternion:setEuler(yaw, pitch, roll)
    local sy, cy = math.sin(yaw / 2), math.cos(yaw / 2)
    local sp, cp = math.sin(pitch / 2), math.cos(pitch / 2)
    local sr, cr = math.sin(roll / 2), math.cos(roll / 2)
    self:setValue(sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
                  cr * cp * cy + sr * sp * sy)
end

function Quaternion.getIdentity() return Quaternion:new(0, 0, 0, 1) end

function Quaternion:dot(q) return self[1] * q[1] + self[2] * q[2] + self[3] * q[3] + self[4] * q[4] end

function Quaternion:length2() return self:dot(self) end

function Quaternion:length() return math.sqrt(self:length2()) end

function Quaternion:normalized()
    local length = self:length()
    return Quaternion:new(self[1] / length, self[2] / length, self[3] / length, self[4] / length)
end

function Quaternion:normalize()
    self:construct(self:normalized())
    return self
end

-- The inverse of a unit quaternion
function Quaternion:inverse() return Quaternion:new(-self[1], -self[2], -self[3], self[4]) end

function Quaternion:angle(q) return math.acos(self:dot(q) / math.sqrt(self:length2() * q:length2())) end

function Quaternion:getAngle() return 2 * math.acos(self[4]) end

function Quaternion:getAxis()
    local s2 = 1 - self[4] * self[4]
    -- no rotation, but for rounding errors: any axis is right
    if s2 < 1e-15 then return vector(1, 0, 0) end
    local s = math.sqrt(s2)
    return vector(self[1] / s, self[2] / s, self[3] / s)
end

--- The rotation at a ratio of the shorter way to another rotation.
function Quaternion:slerp(q, ratio)
    local product = self:dot(q) / math.sqrt(self:length2() * q:length2())
    local sign = product < 0 and -1 or 1
    local angle = math.acos(math.min(1, math.abs(product)))
    local a, b = 1 - ratio, ratio
    -- nearly equal rotations are interpolated linearly, because sin(angle) is about 0
    if angle > 1e-6 then a, b = math.sin(a * angle) / math.sin(angle), math.sin(b * angle) / math.sin(angle) end
    b = b * sign
    return Quaternion:new(a * self[1] + b * q[1], a * self[2] + b * q[2], a * self[3] + b * q[3],
                          a * self[4] + b * q[4])
end

local function product(a, b)
    return Quaternion:new(a[4] * b[1] + a[1] * b[4] + a[2] * b[3] - a[3] * b[2],
                          a[4] * b[2] - a[1] * b[3] + a[2] * b[4] + a[3] * b[1],
                          a[4] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[4],
                          a[4] * b[4] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3])
end

Quaternion.__mul = product
Quaternion.__eq = function(a, b) return a[1] == b[1] and a[2] == b[2] and a[3] == b[3] and a[4] == b[4] end

-- The vector rotated by a unit quaternion: q v q^-1
local function rotate(q, v)
    local r = product(product(q, {v[1], v[2], v[3], 0}), {-q[1], -q[2], -q[3], q[4]})
    return vector(r[1], r[2], r[3])
end

function Vector3:rotate(axis, angle) return rotate(Quaternion:new(axis, angle), self) end

--- The angle about z.
function geometry.get_yaw(q)
    if q.getRotation then q = q:getRotation() end
    local x, y, z, w = q[1], q[2], q[3], q[4]
    return math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)
end

function geometry.create_quaternion_from_yaw(yaw) return Quaternion:new(yaw, 0, 0) end

function geometry.create_quaternion_from_rpy(roll, pitch, yaw) return Quaternion:new(yaw, pitch, roll) end

function geometry.resize_vector(v, length)
    local unit = v:normalized()
    return vector(unit[1] * length, unit[2] * length, unit[3] * length)
end

-- Transforms

local Transform = make_class("Transform")

--- Make a transform from a rotation and a translation; or from another transform.
function Transform:construct(first, origin)
    if first and first.origin then first, origin = first.rotation, first.origin end
    self.rotation = first and Quaternion:new(first) or Quaternion.getIdentity()
    self.origin = origin and Vector3:new(origin) or vector()
end

function Transform.getIdentity() return Transform:new() end

function Transform:getOrigin() return self.origin end

function Transform:getRotation() return Quaternion:new(self.rotation) end

function Transform:setOrigin(origin) self.origin = Vector3:new(origin) end

function Transform:setRotation(q) self.rotation = Quaternion:new(q):normalize() end

function Transform:setIdentity() Transform.construct(self) end

function Transform:set_data(other) Transform.construct(self, other) end

local function apply(t, v)
    local r = rotate(t.rotation, v)
    return vector(r[1] + t.origin[1], r[2] + t.origin[2], r[3] + t.origin[3])
end

function Transform:mult(t1, t2)
    local origin, rotation = apply(t1, t2.origin), product(t1.rotation, t2.rotation)
    self.origin, self.rotation = origin, rotation
end

--- Apply a transform to a vector, a quaternion or another transform.
Transform.__mul = function(t, other)
    if other.origin then
        local result = Transform:new()
        result:mult(t, other)
        return result
    end
    return other[4] and product(t.rotation, other) or apply(t, other)
end

Transform.__eq = function(a, b) return a.origin == b.origin and a.rotation == b.rotation end

function Transform:inverse()
    local back = self.rotation:inverse()
    local o = rotate(back, self.origin)
    return Transform:new(back, vector(-o[1], -o[2], -o[3]))
end

function Transform:inverseTimes(t) return self:inverse() * t end

make_class("Pose", Transform)

local StampedTransform = make_class("StampedTransform", Transform)

function StampedTransform:construct(transform, stamp, frame_id, child_frame_id)
    Transform.construct(self, transform)
    self.stamp = stamp and Time:new(stamp) or Time:new(0, 0)
    self.frame_id, self.child_frame_id = frame_id or "", child_frame_id or ""
end

-- Values with a time and a frame

for _, name in ipairs {"Quaternion", "Vector3", "Point", "Pose"} do
    local parent = geometry[name]
    local class = make_class("Stamped" .. name, parent)
    function class:construct(value, stamp, frame_id)
        parent.construct(self, value)
        self.stamp = stamp and Time:new(stamp) or Time:new(0, 0)
        self.frame_id = frame_id or "NO_ID_STAMPED_DEFAULT_CONSTRUCTION"
    end
    function class:set_data(value) parent.construct(self, value) end
end

--- The name of a value's type in C++, as tolua.type() returns it; for other values, the name of the Lua type.
function geometry.type_of(value)
    return type(value) == "table" and type(value.__type) == "string" and value.__type or type(value)
end

return geometry
