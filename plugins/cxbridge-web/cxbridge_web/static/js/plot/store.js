// The plotted series of the live run and of the open recording; they outlive the view.
import { escapePart, factsPath, get, idPath } from "cx/api.js";
import { findSource } from "cx/plot/names.js";
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
  /** The series of a recording by name; made from all events at the first call. */
  ofRecording(recording, name) {
    if (!this.recorded.has(recording)) this.recorded.set(recording, new Map());
    const seriesByName = this.recorded.get(recording),
      { source, colourNumber } = this.live.get(name);
    let series = seriesByName.get(name);
    if (!series) {
      series = new Series(source, Infinity);
      for (const event of recording.events) series.take(event);
      seriesByName.set(name, series);
    }
    series.colourNumber = colourNumber;
    return series;
  }

  /** Add the samples of an event to the live series. */
  take(event) {
    const seriesWithSample = [...this.live.values()].filter((series) => series.take(event));
    if (seriesWithSample.length) this.notify();
  }

  /** Add a series. Returns the reason for a refusal, or "". */
  add(text) {
    const source = findSource(text, this.app.env);
    if (!source) return "'" + text + "' is not a name of a value";
    if (this.live.has(source.name)) return "";
    if (this.live.size >= MOST_SERIES) return "A plot has at most " + MOST_SERIES + " series: remove one";
    const series = new Series(source),
      takenNumbers = new Set([...this.live.values()].map((each) => each.colourNumber));
    while (takenNumbers.has(series.colourNumber)) series.colourNumber += 1;
    this.live.set(source.name, series);
    if (!this.app.recording) this.takePresentValue(series);
    this.changed();
    return "";
  }
  remove(name) {
    this.live.delete(name);
    this.changed();
  }
  /** Replace the series. Returns the reason for the first refusal, or "". */
  show(names) {
    const wantedNames = new Set(names.map((name) => findSource(name, this.app.env)?.name));
    for (const name of this.names) if (!wantedNames.has(name)) this.remove(name);
    return names.map((name) => this.add(name)).find(Boolean) || "";
  }
  /** Follow the kinds of events of the series, and notify listeners. */
  changed() {
    this.app.keep([...new Set([...this.live.values()].map((each) => each.source.kind))]);
    this.notify();
  }

  /** Let a live series begin with the present value, since events come only with the next change. */
  async takePresentValue(series) {
    const { kind, type, id, env, template, uid } = series.source,
      nowUs = this.app.status?.now_us || this.app.live.time,
      // an event during the request, or the first of several facts, is the first sample
      takeFirst = (event) => series.count || series.take({ ...event, kind, time_us: nowUs });
    try {
      if (kind === "interface") {
        const { data } = await get("blackboard/interfaces/" + escapePart(type) + "/" + idPath(id) + "/data");
        takeFirst({ uid, values: data });
      } else if (kind === "fact")
        for (const fact of await get(factsPath(env, template)))
          takeFirst({ env, template, asserted: true, text: fact.formatted });
      this.notify();
    } catch {
      // the interface or the template does not exist yet: the line begins with its first event
    }
  }
}
export const plotsOf = (app) => PlotStore.of(app);

/** The address of the plot of these values. */
export const plotAddress = (names) => "#/plot" + names.map((name) => "/" + escapePart(name)).join("");

/** Add series to the plot, and go to the plot. */
export function plot(app, names) {
  const store = plotsOf(app),
    [refusal] = names.map((name) => store.add(name)).filter(Boolean);
  if (refusal) app.toast(refusal, true);
  location.hash = plotAddress(store.names);
}
