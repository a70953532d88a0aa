// Where robots and frames were over time, from interface writes: poses, transforms, what navigators say.
import { compose, inverse, yawOf } from "cx/map/plane.js";

const MOST_POINTS = 20_000;
const TYPES = new Set(["Position3DInterface", "TransformInterface", "NavigatorInterface"]);
const typeOf = (uid) => uid.slice(0, uid.indexOf("::"));
const idOf = (uid) => uid.slice(uid.indexOf("::") + 2);
const bare = (frame) => String(frame || "").replace(/^\//, ""); // as in tf: a leading slash does not count

/** A pose in a frame, or a frame in its parent, over time. */
class Track {
  constructor(uid, kind, name) {
    Object.assign(this, { uid, kind, name, points: [], isStatic: false });
  }
  add(point) {
    const last = this.points[this.points.length - 1];
    if (last && point.time < last.time) return;
    if (last && ["x", "y", "yaw", "frame", "seen", "goalX", "goalY"].every((key) => last[key] === point[key]))
      return;
    this.points.push(point);
    if (this.points.length > MOST_POINTS) this.points.splice(0, MOST_POINTS / 4);
  }
  /** The number of points up to a time. */
  count(time) {
    let low = 0,
      high = this.points.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.points[middle].time <= time) low = middle + 1;
      else high = middle;
    }
    return low;
  }
  at(time) {
    return (this.isStatic ? this.points[this.points.length - 1] : this.points[this.count(time) - 1]) || null;
  }
}

export class Tracks {
  constructor() {
    this.poses = new Map(); // uid -> Track
    this.frames = new Map(); // child frame -> Track
    this.graphs = new Map(); // name -> {nodes, edges}
  }

  clear() {
    for (const each of [this.poses, this.frames, this.graphs]) each.clear();
  }

  /** Take the news of an event. Returns whether it had some. */
  take(event) {
    if (event.kind === "navgraph") {
      this.graphs.set(event.graph, { nodes: event.nodes, edges: event.edges });
      return true;
    }
    if (event.kind !== "interface") return false;
    const type = typeOf(event.uid);
    if (!TYPES.has(type)) return false;
    if (type === "TransformInterface") return this.frame(event);
    if (type === "NavigatorInterface") return this.navigator(event);
    return this.pose(event);
  }

  track(map, key, ...about) {
    if (!map.has(key)) map.set(key, new Track(...about));
    return map.get(key);
  }

  pose({ uid, time_us, values }) {
    if (!values.translation || !values.frame) return false;
    this.track(this.poses, uid, uid, "pose", idOf(uid)).add({
      time: time_us,
      frame: bare(values.frame),
      x: values.translation[0],
      y: values.translation[1],
      yaw: yawOf(values.rotation),
      seen: values.visibility_history > 0,
    });
    return true;
  }

  navigator({ uid, time_us, values }) {
    if (typeof values.x !== "number") return false;
    const goes = values.final === false && values.dest_dist > 0;
    this.track(this.poses, uid, uid, "navigator", idOf(uid)).add({
      time: time_us,
      frame: bare(values.target_frame) || "odom",
      x: values.x,
      y: values.y,
      yaw: null,
      seen: true,
      goalX: goes ? values.dest_x : null,
      goalY: goes ? values.dest_y : null,
    });
    return true;
  }

  frame({ uid, time_us, values }) {
    const child = bare(values.child_frame);
    if (!child || !values.translation) return false;
    const track = this.track(this.frames, child, uid, "frame", child);
    track.isStatic = Boolean(values.static_transform);
    track.add({
      time: time_us,
      frame: bare(values.frame),
      x: values.translation[0],
      y: values.translation[1],
      yaw: yawOf(values.rotation),
      seen: true,
    });
    return true;
  }

  /** How a frame lies in the root of its tree at a time: {root, x, y, yaw}. */
  toRoot(frame, time) {
    let lies = { x: 0, y: 0, yaw: 0 },
      root = frame;
    for (const been = new Set(); this.frames.has(root) && !been.has(root);) {
      been.add(root);
      const up = this.frames.get(root).at(time);
      if (!up) break;
      lies = compose(up, lies);
      root = up.frame;
    }
    return { ...lies, root };
  }

  /** How a frame lies in another one at a time; null: they are not connected. */
  between(from, to, time) {
    if (from === to) return { x: 0, y: 0, yaw: 0 };
    const one = this.toRoot(from, time),
      other = this.toRoot(to, time);
    return one.root === other.root ? compose(inverse(other), one) : null;
  }

  /** The frames there are, the usual fixed ones first. */
  frameNames() {
    const found = new Set();
    for (const track of this.poses.values()) for (const { frame } of track.points.slice(-1)) found.add(frame);
    for (const track of this.frames.values()) {
      found.add(track.name);
      for (const { frame } of track.points.slice(-1)) found.add(frame);
    }
    const usual = ["map", "world", "odom"],
      rank = (name) => (usual.includes(name) ? usual.indexOf(name) : usual.length);
    return [...found].sort((a, b) => rank(a) - rank(b) || (a < b ? -1 : 1));
  }

  /**
   * All that has a place in a frame at a time: {track, x, y, yaw, frame, seen, goal}; x is null of what is not
   * connected with the frame.
   */
  placed(frame, time) {
    const found = [];
    for (const track of [...this.poses.values(), ...this.frames.values()]) {
      const point = track.at(time);
      if (!point) continue;
      const lies = this.between(point.frame, frame, time),
        place = lies && compose(lies, { ...point, yaw: point.yaw ?? 0 });
      const goal =
        lies && typeof point.goalX === "number"
          ? compose(lies, { x: point.goalX, y: point.goalY, yaw: 0 })
          : null;
      found.push({
        track,
        goal,
        frame: point.frame,
        seen: point.seen,
        x: place ? place.x : null,
        y: place ? place.y : null,
        yaw: place && point.yaw !== null ? place.yaw : null,
      });
    }
    return found;
  }

  /** Where something was up to a time, seen from a frame: at most `most` points [x, y]. */
  trail(track, frame, time, most = 2000) {
    const end = track.count(time),
      step = Math.max(1, Math.ceil(end / most)),
      way = [];
    for (let at = 0; at < end; at++) {
      if (at % step && at !== end - 1) continue;
      const point = track.points[at],
        lies = this.between(point.frame, frame, point.time);
      if (!lies) continue;
      const place = compose(lies, { ...point, yaw: 0 });
      way.push([place.x, place.y]);
    }
    return way;
  }
}
