// Proposals for a plot: names for completion, and the values that changed most.
import { factsPath, get } from "cx/api.js";
import { parseFact, valuesOf } from "cx/clips/text.js";
import { fieldNames } from "cx/plot/names.js";

const MOST_NAMES = 4000; // for completion

/** The present interfaces and facts of a daemon as events; a failed request gives none. */
async function readAsEvents(app) {
  const { env } = app,
    listAt = (path) => get(path).catch(() => []),
    [interfaces, facts] = await Promise.all([listAt("cxbridge/interfaces"), listAt(factsPath(env))]);
  return [
    ...interfaces.map(({ type, id, data }) => ({ kind: "interface", uid: type + "::" + id, values: data })),
    ...facts.map(({ template_name: template, formatted: text }) => ({ kind: "fact", env, template, text })),
  ];
}

/** Return a promise of the names of values that a plot can show, sorted; about MOST_NAMES at most. */
export async function choices(app) {
  const names = new Set(["loop"]),
    templates = new Set();
  for (const { kind, uid, values, env, template, text } of app.recording?.events ??
    (await readAsEvents(app))) {
    if (kind === "interface")
      for (const [field, value] of Object.entries(values))
        for (const name of fieldNames(uid, field, value)) names.add(name);
    const templateName = env + ":" + template;
    if (kind === "fact" && !templates.has(templateName)) {
      templates.add(templateName);
      for (const slot of parseFact(text)?.slots?.keys() ?? []) names.add(templateName + "." + slot);
    }
    if (names.size > MOST_NAMES) break;
  }
  return [...names].sort();
}

const MOST_PROPOSALS = 8,
  // values that change without a meaning of their own: counters, times, and elements of a rotation
  UNWANTED = /(^|[.:])(msgid|time|timestamp|progress_id|visibility_history|rotation)(\[|$)/;
const isNumber = (value) => value !== "" && Number.isFinite(Number(value));

/** Counts the changes of numbers in events, to propose the values that change most. */
export class Proposals {
  statistics = new Map(); // name -> {count (of changes), last, least, greatest}

  constructor(events = []) {
    for (const event of events) this.take(event);
  }

  take(event) {
    if (event.kind === "interface")
      for (const [field, value] of Object.entries(event.values)) {
        const values = [value].flat();
        fieldNames(event.uid, field, value).forEach((name, at) => this.note(name, values[at]));
      }
    else if (event.kind === "loop") this.note("loop", event.duration_us);
    // a text without digits has no numbers: it need not be parsed
    else if (event.kind === "fact" && event.asserted && /\d/.test(event.text)) this.takeFact(event);
  }
  takeFact({ env, template, text }) {
    // facts of a template are told apart by a name or an id; a number there may itself be plotted
    const slots = parseFact(text)?.slots ?? new Map(),
      id = ["name", "id"].find((slot) => slots.has(slot) && !isNumber(slots.get(slot))),
      conditionText = id ? "{" + id + "=" + valuesOf(slots.get(id)).join(" ") + "}" : "";
    for (const [slot, value] of slots) this.note(env + ":" + template + conditionText + "." + slot, value);
  }
  note(name, value) {
    if (typeof value === "boolean" || !isNumber(value) || UNWANTED.test(name)) return;
    const number = Number(value),
      { count, last, least, greatest } = this.statistics.get(name) || {
        count: -1, // the first value is no change
        least: number,
        greatest: number,
      };
    if (last === number) return;
    this.statistics.set(name, {
      count: count + 1,
      last: number,
      least: Math.min(least, number),
      greatest: Math.max(greatest, number),
    });
  }

  /**
   * At most MOST_PROPOSALS values that changed twice or more, those with the most changes first: [{name,
   * count, least, greatest}].
   */
  get best() {
    return [...this.statistics]
      .map(([name, numbers]) => ({ name, ...numbers }))
      .filter(({ count }) => count > 1)
      .sort((one, other) => other.count - one.count || (one.name < other.name ? -1 : 1))
      .slice(0, MOST_PROPOSALS);
  }
}
