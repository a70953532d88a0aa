-- The object tf of Fawkes: transforms between frames, from the host's buffer.

local core = ...
local checked, geometry, host = core.include("checked"), core.include("geometry"), core.host
local Time = core.include("time").Time

local tf = {}

local function microseconds(time) return time and time.us or 0 end

-- Set the fields of a StampedTransform. As in Fawkes, the names of frames lose a slash at the start.
local function fill(out, target, source, x, y, z, qx, qy, qz, qw, stamp)
    out.origin = geometry.Vector3:new(x, y, z)
    out.rotation = geometry.Quaternion:new(qx, qy, qz, qw)
    out.stamp = Time:new(0, stamp)
    out.frame_id, out.child_frame_id = target:gsub("^/", ""), (source:gsub("^/", ""))
    return out
end

function tf:frame_exists(frame) return checked(host.tf_frame_exists(frame)) end

--- can_transform(target, source, time), or
-- can_transform(target, target_time, source, source_time, fixed_frame).
function tf:can_transform(target, second, third, source_time, fixed)
    if fixed then
        return checked(host.tf_can_transform(target, fixed, microseconds(second))) and
                   checked(host.tf_can_transform(fixed, third, microseconds(source_time)))
    end
    return checked(host.tf_can_transform(target, second, microseconds(third)))
end

--- lookup_transform(target, source, [time,] into), or
-- lookup_transform(target, target_time, source, source_time, fixed_frame, into).
function tf:lookup_transform(target, second, third, source_time, fixed, into)
    if fixed then
        return fill(into, target, third, checked(host.tf_lookup_via(
            target, microseconds(second), third, microseconds(source_time), fixed)))
    end
    -- without a time, the third argument is the transform to fill
    local at = source_time and third
    fill(source_time or third, target, second, checked(host.tf_lookup(target, second, microseconds(at))))
end

local function find_transform(target, target_time, value, fixed)
    local transform = geometry.StampedTransform:new()
    if fixed then
        tf:lookup_transform(target, target_time, value.frame_id, value.stamp, fixed, transform)
    else
        tf:lookup_transform(target, value.frame_id, value.stamp, transform)
    end
    return transform
end

local function transformer(apply)
    --- (target, value, out), or (target, target_time, value, fixed_frame, out)
    return function(_, target, second, third, fixed, into)
        local value, target_time, out = second, nil, third
        if fixed then value, target_time, out = third, second, into end
        local transform = find_transform(target, target_time, value, fixed)
        out:set_data(apply(transform, value))
        out.stamp, out.frame_id = Time:new(transform.stamp), target
    end
end

tf.transform_point = transformer(function(transform, value) return transform * value end)
tf.transform_pose = transformer(function(transform, value) return transform * value end)
tf.transform_quaternion = transformer(function(transform, value)
    -- the tolerance of Fawkes
    assert(math.abs(value:length2() - 1) <= 0.01, "Quaternion malformed, its length should be 1.0")
    return transform * value
end)
tf.transform_vector = transformer(function(transform, value)
    return geometry.Transform:new(transform.rotation) * value
end)

return tf
