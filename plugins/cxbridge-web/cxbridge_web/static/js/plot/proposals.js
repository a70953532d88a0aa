// The values that changed most, as proposals for a plot.
import { parseFact, valuesOf } from "cx/clips/text.js";
import { fieldNames } from "cx/plot/names.js";

const MOST = 8,
  COUNTED = /(^|[.:])(msgid|time|timestamp|progress_id|visibility_history|rotation)(\[|$)/; // they only count, or say nothing alone
const isNumber = (value) => value !== "" && Number.isFinite(Number(value));

/** Counts the changes of values by name. */
export class Proposals {
  constructor() {
    this.seen = new Map(); // name -> {count, last, least, greatest}
  }

  static of(events) {
    const found = new Proposals();
    for (const event of events) found.take(event);
    return found;
  }

  take(event) {
    if (event.kind === "interface")
      for (const [field, value] of Object.entries(event.values)) {
        const values = [value].flat();
        fieldNames(event.uid, field, value).forEach((name, at) => this.note(name, values[at]));
      }
    else if (event.kind === "loop") this.note("loop", event.duration_us);
    else if (event.kind === "fact" && event.asserted && /\d/.test(event.text)) this.takeFact(event);
  }
  takeFact({ env, template, text }) {
    const fact = parseFact(text);
    if (!fact || !fact.slots) return;
    const id = ["name", "id"].find((slot) => fact.slots.has(slot) && !isNumber(fact.slots.get(slot))),
      where = id ? "{" + id + "=" + valuesOf(fact.slots.get(id)).join(" ") + "}" : "";
    for (const [slot, value] of fact.slots)
      if (isNumber(value)) this.note(env + ":" + template + where + "." + slot, value);
  }
  note(name, value) {
    if (typeof value === "boolean" || !isNumber(value) || COUNTED.test(name)) return;
    const number = Number(value),
      known = this.seen.get(name);
    if (!known) this.seen.set(name, { count: 0, last: number, least: number, greatest: number });
    else if (known.last !== number) {
      known.count += 1;
      known.last = number;
      known.least = Math.min(known.least, number);
      known.greatest = Math.max(known.greatest, number);
    }
  }

  /** The names with the most changes: [{name, count, least, greatest}]. */
  get best() {
    return [...this.seen]
      .map(([name, known]) => ({ name, ...known }))
      .filter(({ count }) => count > 1)
      .sort((one, other) => other.count - one.count || (one.name < other.name ? -1 : 1))
      .slice(0, MOST);
  }
}
