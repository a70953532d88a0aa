// Poses in the plane: {x, y, yaw}, metres and radians.

/** The turn about z of a quaternion x, y, z, w. */
export function yawOf(rotation) {
  if (!rotation || rotation.length !== 4) return 0;
  const [x, y, z, w] = rotation;
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

/** A pose that is given in another pose, seen from where that one is given. */
export function compose(outer, inner) {
  const cos = Math.cos(outer.yaw),
    sin = Math.sin(outer.yaw);
  return {
    x: outer.x + cos * inner.x - sin * inner.y,
    y: outer.y + sin * inner.x + cos * inner.y,
    yaw: outer.yaw + inner.yaw,
  };
}

export function inverse({ x, y, yaw }) {
  const cos = Math.cos(yaw),
    sin = Math.sin(yaw);
  return { x: -(cos * x + sin * y), y: sin * x - cos * y, yaw: -yaw };
}
