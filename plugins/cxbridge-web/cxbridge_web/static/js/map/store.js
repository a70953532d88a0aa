// The tracks that the map shows: live ones, and those of the recording that is open.
import { get } from "cx/api.js";
import { Tracks } from "cx/map/tracks.js";

const stores = new WeakMap();

/** The one store of the page. */
export function tracksOf(app) {
  if (!stores.has(app)) stores.set(app, new TrackStore(app));
  return stores.get(app);
}

class TrackStore {
  constructor(app) {
    this.app = app;
    this.live = new Tracks();
    this.recorded = new WeakMap();
    this.listeners = new Set();
    app.live.onEvent((event) => {
      if (this.live.take(event)) this.notify();
    });
  }

  /** Of the recording, if one is open. */
  get tracks() {
    const { recording } = this.app;
    if (!recording || recording.isPast) return this.live;
    let found = this.recorded.get(recording);
    if (!found) {
      found = new Tracks();
      for (const event of recording.events) found.take(event);
      this.recorded.set(recording, found);
    }
    return found;
  }

  onChange(listener) {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
  notify() {
    for (const listener of [...this.listeners]) listener();
  }

  /** What holds now: the graphs, and where everything is. */
  async read() {
    const now = (this.app.status && this.app.status.now_us) || this.app.live.time;
    const [graphs, interfaces] = await Promise.all([get("cxbridge/navgraphs"), get("cxbridge/interfaces")]);
    for (const graph of graphs) this.live.take({ ...graph, kind: "navgraph" });
    for (const { type, id, data } of interfaces) {
      const event = { kind: "interface", uid: type + "::" + id, time_us: now, values: data };
      this.live.take(event);
    }
    this.notify();
  }
}
