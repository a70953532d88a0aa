// The tracks that the map shows: live ones, and those of the recording that is open.
import { get } from "cx/api.js";
import { Tracks } from "cx/map/tracks.js";
import { Store } from "cx/stores.js";

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

  /** What holds now: the graphs, and where everything is. */
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
