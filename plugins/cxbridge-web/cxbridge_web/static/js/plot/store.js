// What is plotted: the series, live ones and those of the recording that is open. Lives as long as the page.
import { get, part } from "cx/api.js";
import { parseName } from "cx/plot/names.js";
import { Series } from "cx/plot/series.js";

export const MOST_SERIES = 8;
const path = (id) => id.split("/").map(part).join("/");
const stores = new WeakMap();

/** The one store of the page. */
export function plotsOf(app) {
  if (!stores.has(app)) stores.set(app, new PlotStore(app));
  return stores.get(app);
}

/** The address that shows these names. */
export const plotAddress = (names) => "#/plot" + names.map((name) => "/" + part(name)).join("");

/** Add fields where they are shown, and go to the plot. */
export function plot(app, names) {
  const store = plotsOf(app);
  const refused = names.map((name) => store.add(name)).filter(Boolean);
  if (refused.length) app.toast(refused[0], true);
  location.hash = plotAddress(store.names);
}

class PlotStore {
  constructor(app) {
    this.app = app;
    this.live = new Map(); // name -> series
    this.recorded = new Map();
    this.recording = null;
    this.listeners = new Set();
    app.live.onEvent((event) => this.take(event));
  }

  get names() {
    return [...this.live.keys()];
  }
  /** The series that are shown: of the recording, if one is open. */
  get series() {
    const { recording } = this.app;
    if (!recording) return [...this.live.values()];
    if (recording !== this.recording) {
      this.recording = recording;
      this.recorded.clear();
    }
    return this.names.map((name) => this.ofRecording(name));
  }

  ofRecording(name) {
    let found = this.recorded.get(name);
    if (!found) {
      const live = this.live.get(name);
      found = new Series(live.source, Infinity);
      for (const event of this.recording.events) found.take(event);
      this.recorded.set(name, found);
    }
    found.number = this.live.get(name).number;
    return found;
  }

  take(event) {
    let changed = false;
    for (const series of this.live.values()) changed = series.take(event) || changed;
    if (changed) this.notify();
  }

  notify() {
    for (const listener of [...this.listeners]) listener();
  }
  onChange(listener) {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  /** Show one more. Returns why not; "" when it is shown. */
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
    this.recorded.delete(name);
    this.changed();
  }

  /** Show these and no others. Returns why one of them is not shown. */
  show(names) {
    const wanted = new Set(names.map((name) => parseName(name, this.app.env)?.name));
    for (const name of this.names) if (!wanted.has(name)) this.remove(name);
    return names.map((name) => this.add(name)).find(Boolean) || "";
  }

  changed() {
    this.app.keep([...new Set([...this.live.values()].map((each) => each.source.kind))]);
    this.notify();
  }

  /** What holds now: an event comes only with the next change. */
  async begin(series) {
    const { kind, type, id, env, template, uid } = series.source;
    try {
      const now = (this.app.status && this.app.status.now_us) || this.app.live.time;
      const sample = (event) => {
        if (!series.count) series.take({ ...event, time_us: now });
      };
      if (kind === "interface") {
        const { data } = await get("blackboard/interfaces/" + part(type) + "/" + path(id) + "/data");
        sample({ kind, uid, values: data });
      } else if (kind === "fact") {
        const facts = await get("clips/" + part(env) + "/facts?formatted=true&template=" + part(template));
        for (const fact of facts) sample({ kind, env, template, asserted: true, text: fact.formatted });
      }
      this.notify();
    } catch {
      // it is not there yet: the first event begins the line
    }
  }
}
