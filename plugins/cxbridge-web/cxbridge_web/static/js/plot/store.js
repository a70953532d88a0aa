// The plotted series of the live run and of the open recording; they outlive the view.
import { factsPath, get, idPath, part } from "cx/api.js";
import { parseName } from "cx/plot/names.js";
import { Series } from "cx/plot/series.js";
import { Store } from "cx/stores.js";

export const MOST_SERIES = 8;

class PlotStore extends Store {
  constructor(app) {
    super(app, () => new Map()); // name -> series
    app.live.onEvent((event) => this.take(event));
  }

  get names() {
    return [...this.live.keys()];
  }
  /** The series of the open recording, else of the live run. */
  get series() {
    const { recording } = this.app;
    return recording ? this.names.map((name) => this.ofRecording(recording, name)) : [...this.live.values()];
  }
  ofRecording(recording, name) {
    if (!this.recorded.has(recording)) this.recorded.set(recording, new Map());
    const known = this.recorded.get(recording),
      { source, number } = this.live.get(name);
    let found = known.get(name);
    if (!found) {
      found = new Series(source, Infinity);
      for (const event of recording.events) found.take(event);
      known.set(name, found);
    }
    found.number = number;
    return found;
  }

  take(event) {
    const changed = [...this.live.values()].filter((series) => series.take(event));
    if (changed.length) this.notify();
  }

  /** Add a series. Returns the reason for a refusal, or "". */
  add(text) {
    const source = parseName(text, this.app.env);
    if (!source) return "'" + text + "' is not a name of a value";
    if (this.live.has(source.name)) return "";
    if (this.live.size >= MOST_SERIES) return "A plot has at most " + MOST_SERIES + " series: remove one";
    const series = new Series(source),
      taken = new Set([...this.live.values()].map((each) => each.number));
    while (taken.has(series.number)) series.number += 1;
    this.live.set(source.name, series);
    if (!this.app.recording) this.begin(series);
    this.changed();
    return "";
  }
  remove(name) {
    this.live.delete(name);
    this.changed();
  }
  /** Replace the series. Returns the reason for the first refusal, or "". */
  show(names) {
    const wanted = new Set(names.map((name) => parseName(name, this.app.env)?.name));
    for (const name of this.names) if (!wanted.has(name)) this.remove(name);
    return names.map((name) => this.add(name)).find(Boolean) || "";
  }
  changed() {
    this.app.keep([...new Set([...this.live.values()].map((each) => each.source.kind))]);
    this.notify();
  }

  /** Read the present value: the next event comes with the next change. */
  async begin(series) {
    const { kind, type, id, env, template, uid } = series.source,
      now = this.app.status?.now_us || this.app.live.time,
      sample = (event) => series.count || series.take({ ...event, kind, time_us: now });
    try {
      if (kind === "interface") {
        const { data } = await get("blackboard/interfaces/" + part(type) + "/" + idPath(id) + "/data");
        sample({ uid, values: data });
      } else if (kind === "fact")
        for (const fact of await get(factsPath(env, template)))
          sample({ env, template, asserted: true, text: fact.formatted });
      this.notify();
    } catch {
      // the interface or the template does not exist yet: the line begins with its first event
    }
  }
}
export const plotsOf = (app) => PlotStore.of(app);

export const plotAddress = (names) => "#/plot" + names.map((name) => "/" + part(name)).join("");

/** Add series to the plot, and go to the plot. */
export function plot(app, names) {
  const store = plotsOf(app),
    [refused] = names.map((name) => store.add(name)).filter(Boolean);
  if (refused) app.toast(refused, true);
  location.hash = plotAddress(store.names);
}
