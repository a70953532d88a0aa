// The places of robots and frames over time, from writes of pose, transform and navigator interfaces.
// Poses are in the plane: {x, y, yaw}, metres and radians.
import { get } from "cx/api.js";
import { countWhile } from "cx/names.js";
import { Store } from "cx/stores.js";

const MOST_POINTS = 20_000; // of a track; the oldest quarter makes room
const USUAL_FRAMES = ["map", "world", "odom"];
// the members of a point that make it differ from the point before
const COMPARED = ["x", "y", "yaw", "frame", "seen", "goalX", "goalY"];
const IDENTITY = { x: 0, y: 0, yaw: 0 };
const withoutSlash = (frame) => String(frame || "").replace(/^\//, ""); // as in tf, without a leading slash

/** The turn about the z axis in radians of a quaternion [x, y, z, w]; 0 for other values. */
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
/** The pose of the outer frame in the frame of a pose: compose(inverse(pose), pose) is IDENTITY. */
function inverse({ x, y, yaw }) {
  const cos = Math.cos(yaw),
    sin = Math.sin(yaw);
  return { x: -(cos * x + sin * y), y: sin * x - cos * y, yaw: -yaw };
}

/** A pose in a frame, or a frame in its parent, over time. */
class Track {
  points = []; // {time, frame, x, y, yaw, seen, goalX, goalY}, ordered by time
  isStatic = false;

  constructor(kind, name) {
    Object.assign(this, { kind, name });
  }
  /** Add a point, unless it is older than the last point or equal to it. */
  add(point) {
    const last = this.points.at(-1);
    if (last && (point.time < last.time || COMPARED.every((key) => last[key] === point[key]))) return;
    this.points.push(point);
    if (this.points.length > MOST_POINTS) this.points.splice(0, MOST_POINTS / 4);
  }
  /** The number of points up to a time. */
  count(time) {
    return countWhile(this.points, (point) => point.time <= time);
  }
  /** The point at a time; null before the first point. */
  at(time) {
    return (this.isStatic ? this.points.at(-1) : this.points[this.count(time) - 1]) || null;
  }
}

/** The pose in the values of an interface with `translation` and `rotation`. @param more added members */
const poseOf = ({ frame, translation: [x, y], rotation }, more) => ({
  frame: withoutSlash(frame),
  x,
  y,
  yaw: yawOf(rotation),
  ...more,
});

/** The tracks of poses and frames, and the navigation graphs. */
export class Tracks {
  poses = new Map(); // uid -> Track
  frames = new Map(); // child frame -> Track
  graphs = new Map(); // name -> {nodes, edges}

  /** Take an event, and return whether it has a pose, a frame or a graph. */
  take({ kind, uid, time_us: time, values, ...navgraph }) {
    if (kind === "navgraph")
      this.graphs.set(navgraph.graph, { nodes: navgraph.nodes, edges: navgraph.edges });
    if (kind !== "interface") return kind === "navgraph";
    const [type, id] = uid.split(/::(.*)/s),
      trackAndPlace = this["of" + type]?.(values, uid, id); // the method of the type of interface
    if (!trackAndPlace) return false;
    const [track, place] = trackAndPlace;
    track.add({ time, ...place });
    return true;
  }
  /** The track under a key; a new track if there is none. */
  track(map, key, kind, name) {
    if (!map.has(key)) map.set(key, new Track(kind, name));
    return map.get(key);
  }

  ofPosition3DInterface(values, uid, id) {
    if (!values.translation || !values.frame) return null;
    const track = this.track(this.poses, uid, "pose", id);
    return [track, poseOf(values, { seen: values.visibility_history > 0 })];
  }
  ofNavigatorInterface({ x, y, final, dest_dist: distance, target_frame: frame, ...values }, uid, id) {
    if (typeof x !== "number") return null;
    const isDriving = final === false && distance > 0,
      goal = { goalX: isDriving ? values.dest_x : null, goalY: isDriving ? values.dest_y : null };
    const track = this.track(this.poses, uid, "navigator", id);
    // "odom" is also the default of foxglove/messages.py
    return [track, { frame: withoutSlash(frame) || "odom", x, y, yaw: null, seen: true, ...goal }];
  }
  ofTransformInterface(values) {
    const child = withoutSlash(values.child_frame);
    if (!child || !values.translation) return null;
    const track = this.track(this.frames, child, "frame", child);
    track.isStatic = Boolean(values.static_transform);
    return [track, poseOf(values, { seen: true })];
  }

  /** The pose of a frame in the root of its tree at a time: {root, x, y, yaw}. */
  poseInRoot(frame, time) {
    let pose = IDENTITY,
      root = frame;
    // each frame is visited once: wrong transforms may form a cycle
    for (const visited = new Set(); this.frames.has(root) && !visited.has(root);) {
      visited.add(root);
      const inParent = this.frames.get(root).at(time);
      if (!inParent) break;
      pose = compose(inParent, pose);
      root = inParent.frame;
    }
    return { ...pose, root };
  }

  /** The pose of a frame in another frame at a time; null if the frames are not connected. */
  between(from, to, time) {
    if (from === to) return IDENTITY;
    const fromPose = this.poseInRoot(from, time),
      toPose = this.poseInRoot(to, time);
    return fromPose.root === toPose.root ? compose(inverse(toPose), fromPose) : null;
  }

  /** The names of the frames of the last points, the usual fixed frames first. */
  frameNames() {
    const tracks = [...this.poses.values(), ...this.frames.values()],
      parents = tracks.flatMap(({ points }) => points.slice(-1)).map(({ frame }) => frame),
      rank = (name) => (USUAL_FRAMES.includes(name) ? USUAL_FRAMES.indexOf(name) : USUAL_FRAMES.length);
    return [...new Set([...parents, ...this.frames.keys()])].sort(
      (a, b) => rank(a) - rank(b) || (a < b ? -1 : 1),
    );
  }

  /**
   * The places of the tracks in a frame at a time: {track, x, y, yaw, frame, seen, goal}; x is null for a
   * track that is not connected to the frame. Tracks without a point up to the time are left out.
   */
  placed(frame, time) {
    return [...this.poses.values(), ...this.frames.values()].flatMap((track) => {
      const point = track.at(time),
        framePose = point && this.between(point.frame, frame, time),
        place = framePose
          ? compose(framePose, { ...point, yaw: point.yaw ?? 0 })
          : { x: null, y: null, yaw: null };
      if (!point) return [];
      const hasGoal = framePose && typeof point.goalX === "number",
        goal = hasGoal ? compose(framePose, { x: point.goalX, y: point.goalY, yaw: 0 }) : null;
      if (point.yaw === null) place.yaw = null;
      return [{ track, goal, frame: point.frame, seen: point.seen, ...place }];
    });
  }

  /** The path of a track up to a time, in a frame: at most `most` points [x, y], and the last point. */
  trail(track, frame, time, most = 2000) {
    const end = track.count(time),
      step = Math.max(1, Math.ceil(end / most));
    return track.points
      .slice(0, end)
      .filter((_, at) => at % step === 0 || at === end - 1)
      .flatMap((point) => {
        const framePose = this.between(point.frame, frame, point.time),
          { x, y } = framePose ? compose(framePose, { ...point, yaw: 0 }) : {};
        return framePose ? [[x, y]] : [];
      });
  }
}

/** The tracks of the live run, or of the open recording. */
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
