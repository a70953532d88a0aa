// The places of robots and frames over time, from writes of pose, transform and navigator interfaces.
// Poses are in the plane: {x, y, yaw}, metres and radians.
import { get } from "cx/api.js";
import { countWhile } from "cx/names.js";
import { Store } from "cx/stores.js";

const MOST_POINTS = 20_000;
const USUAL = ["map", "world", "odom"];
const SAME = ["x", "y", "yaw", "frame", "seen", "goalX", "goalY"];
const HERE = { x: 0, y: 0, yaw: 0 };
const bare = (frame) => String(frame || "").replace(/^\//, ""); // as in tf, without a leading slash

/** The turn about z of a quaternion x, y, z, w. */
function yawOf(rotation) {
  if (rotation?.length !== 4) return 0;
  const [x, y, z, w] = rotation;
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}
/** The pose `inner`, given in the frame of the pose `outer`, in the frame of `outer`. */
function compose(outer, inner) {
  const cos = Math.cos(outer.yaw),
    sin = Math.sin(outer.yaw);
  return {
    x: outer.x + cos * inner.x - sin * inner.y,
    y: outer.y + sin * inner.x + cos * inner.y,
    yaw: outer.yaw + inner.yaw,
  };
}
function inverse({ x, y, yaw }) {
  const cos = Math.cos(yaw),
    sin = Math.sin(yaw);
  return { x: -(cos * x + sin * y), y: sin * x - cos * y, yaw: -yaw };
}

/** A pose in a frame, or a frame in its parent, over time. */
class Track {
  points = [];
  isStatic = false;

  constructor(kind, name) {
    Object.assign(this, { kind, name });
  }
  add(point) {
    const last = this.points.at(-1);
    if (last && (point.time < last.time || SAME.every((key) => last[key] === point[key]))) return;
    this.points.push(point);
    if (this.points.length > MOST_POINTS) this.points.splice(0, MOST_POINTS / 4);
  }
  /** The number of points up to a time. */
  count(time) {
    return countWhile(this.points, (point) => point.time <= time);
  }
  at(time) {
    return (this.isStatic ? this.points.at(-1) : this.points[this.count(time) - 1]) || null;
  }
}

/** The pose in the values of an interface with `translation` and `rotation`. */
const poseOf = ({ frame, translation: [x, y], rotation }, more) => ({
  frame: bare(frame),
  x,
  y,
  yaw: yawOf(rotation),
  ...more,
});

export class Tracks {
  poses = new Map(); // uid -> Track
  frames = new Map(); // child frame -> Track
  graphs = new Map(); // name -> {nodes, edges}

  /** Take an event, and return whether it has a pose, a frame or a graph. */
  take({ kind, uid, time_us: time, values, ...rest }) {
    if (kind === "navgraph") this.graphs.set(rest.graph, { nodes: rest.nodes, edges: rest.edges });
    if (kind !== "interface") return kind === "navgraph";
    const [type, id] = uid.split(/::(.*)/s),
      point = this["of" + type]?.(values, uid, id);
    if (!point) return false;
    const [track, place] = point;
    track.add({ time, ...place });
    return true;
  }
  track(map, key, ...about) {
    if (!map.has(key)) map.set(key, new Track(...about));
    return map.get(key);
  }

  ofPosition3DInterface(values, uid, id) {
    if (!values.translation || !values.frame) return null;
    const track = this.track(this.poses, uid, "pose", id);
    return [track, poseOf(values, { seen: values.visibility_history > 0 })];
  }
  ofNavigatorInterface({ x, y, final, dest_dist: distance, target_frame: frame, ...values }, uid, id) {
    if (typeof x !== "number") return null;
    const goes = final === false && distance > 0,
      goal = { goalX: goes ? values.dest_x : null, goalY: goes ? values.dest_y : null };
    const track = this.track(this.poses, uid, "navigator", id);
    return [track, { frame: bare(frame) || "odom", x, y, yaw: null, seen: true, ...goal }];
  }
  ofTransformInterface(values) {
    const child = bare(values.child_frame);
    if (!child || !values.translation) return null;
    const track = this.track(this.frames, child, "frame", child);
    track.isStatic = Boolean(values.static_transform);
    return [track, poseOf(values, { seen: true })];
  }

  /** The pose of a frame in the root of its tree at a time: {root, x, y, yaw}. */
  toRoot(frame, time) {
    let lies = HERE,
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

  /** The pose of a frame in another frame at a time; null if the frames are not connected. */
  between(from, to, time) {
    if (from === to) return HERE;
    const one = this.toRoot(from, time),
      other = this.toRoot(to, time);
    return one.root === other.root ? compose(inverse(other), one) : null;
  }

  /** The names of all frames, the usual fixed frames first. */
  frameNames() {
    const tracks = [...this.poses.values(), ...this.frames.values()],
      last = tracks.flatMap(({ points }) => points.slice(-1)).map(({ frame }) => frame),
      rank = (name) => (USUAL.includes(name) ? USUAL.indexOf(name) : USUAL.length);
    return [...new Set([...last, ...this.frames.keys()])].sort(
      (a, b) => rank(a) - rank(b) || (a < b ? -1 : 1),
    );
  }

  /**
   * The places of all tracks in a frame at a time: {track, x, y, yaw, frame, seen, goal}; x is null for a track
   * that is not connected to the frame.
   */
  placed(frame, time) {
    return [...this.poses.values(), ...this.frames.values()].flatMap((track) => {
      const point = track.at(time),
        lies = point && this.between(point.frame, frame, time),
        place = lies ? compose(lies, { ...point, yaw: point.yaw ?? 0 }) : { x: null, y: null, yaw: null };
      if (!point) return [];
      const hasGoal = lies && typeof point.goalX === "number",
        goal = hasGoal ? compose(lies, { x: point.goalX, y: point.goalY, yaw: 0 }) : null;
      if (point.yaw === null) place.yaw = null;
      return [{ track, goal, frame: point.frame, seen: point.seen, ...place }];
    });
  }

  /** The path of a track up to a time, in a frame: at most `most` points [x, y]. */
  trail(track, frame, time, most = 2000) {
    const end = track.count(time),
      step = Math.max(1, Math.ceil(end / most));
    return track.points
      .slice(0, end)
      .filter((_, at) => at % step === 0 || at === end - 1)
      .flatMap((point) => {
        const lies = this.between(point.frame, frame, point.time),
          { x, y } = lies ? compose(lies, { ...point, yaw: 0 }) : {};
        return lies ? [[x, y]] : [];
      });
  }
}

export class TrackStore extends Store {
  constructor(app) {
    super(app, (events = []) => {
      const tracks = new Tracks();
      for (const event of events) tracks.take(event);
      return tracks;
    });
    app.live.onEvent((event) => this.live.take(event) && this.notify());
  }

  get tracks() {
    return this.now;
  }

  /** Read the present graphs and poses. */
  async read() {
    const now = this.app.status?.now_us || this.app.live.time,
      [graphs, interfaces] = await Promise.all([get("cxbridge/navgraphs"), get("cxbridge/interfaces")]);
    for (const graph of graphs) this.live.take({ ...graph, kind: "navgraph" });
    for (const { type, id, data: values } of interfaces)
      this.live.take({ kind: "interface", uid: type + "::" + id, time_us: now, values });
    this.notify();
  }
}

export const tracksOf = (app) => TrackStore.of(app);
