// The facts of the world model that changed, in order: of the agent's own templates, of the domain and of wm-fact.
import { templateOwners } from "cx/clips/constructs.js";
import { parseFact, valuesOf } from "cx/clips/text.js";

const MOST = 20_000,
  SHARED = new Set(["domain-fact", "wm-fact"]), // templates of the core whose facts are the agent's world
  NAMES = new Set(["id", "name", "key"]),
  COPY = /^\(wm-fact \(id "?\/domain\//, // of a domain-fact, which is shown
  READ = /Interface$/; // facts about interfaces
const stores = new WeakMap();

/** The one store of the page. */
export function changesOf(app) {
  if (!stores.has(app)) stores.set(app, new ChangeStore(app));
  return stores.get(app);
}

/** A fact as people say it: at robot1 lab. @param old another fact of the template: only what differs is told */
function sentence(text, old = "") {
  const fact = text && parseFact(text);
  if (!fact || !fact.slots) return text;
  const words = (slot) => valuesOf(fact.slots.get(slot)).join(" ");
  if (fact.template === "domain-fact") return (words("name") + " " + words("param-values")).trim();
  if (fact.template === "wm-fact") return words("id") + " = " + (words("values") || words("value"));
  const before = (old && parseFact(old)?.slots) || new Map(),
    told = [...fact.slots].filter(([slot, value]) => NAMES.has(slot) || before.get(slot) !== value);
  return fact.template + " " + told.map(([slot, value]) => slot + " " + value).join(", ");
}

/** Collects changes; a retraction and an assertion of one template at one time are one change. */
class Changes {
  list = [];

  take({ env, time_us: time, asserted, template, text }, step) {
    const last = this.list.at(-1);
    if (
      asserted &&
      last &&
      !last.to &&
      last.time === time &&
      last.template === template &&
      last.env === env
    ) {
      Object.assign(last, { to: text, step });
      if (last.from === text) this.list.pop(); // asserted anew without a change
      return;
    }
    this.list.push({ env, time, template, step, from: asserted ? "" : text, to: asserted ? text : "" });
    if (this.list.length > MOST) this.list.splice(0, MOST / 5);
  }
}

class ChangeStore {
  constructor(app) {
    this.app = app;
    this.live = new Changes();
    this.owners = new Map(); // environment -> whose its templates are
    this.recorded = new WeakMap();
    app.live.onEvent((event) => {
      if (event.kind === "fact") this.live.take(event, 0);
    });
  }

  get list() {
    const { recording } = this.app;
    if (!recording || recording.isPast) return this.live.list;
    let found = this.recorded.get(recording);
    if (!found) {
      found = new Changes();
      recording.events.forEach((event, at) => {
        if (event.kind === "fact") found.take(event, at + 1);
      });
      this.recorded.set(recording, found);
    }
    return found.list;
  }

  /**
   * The changes up to the moment, the latest first: {time, before, after}.
   * @param later called when it is known whose the templates are
   */
  latest(most, later) {
    const { app, list } = this,
      { recording, env } = app,
      own = this.ownersOf(env, later),
      until = app.selection.value.time ?? Infinity,
      found = [];
    for (let at = list.length - 1; at >= 0 && found.length < most; at--) {
      const { step, time, template, env: of, from, to } = list[at],
        isOver = recording && !recording.isPast ? step <= recording.at : time <= until;
      const isWorld = SHARED.has(template)
        ? !COPY.test(to || from)
        : own.has(template) && !READ.test(template);
      if (isOver && of === env && isWorld)
        found.push({ time, before: sentence(from, to), after: sentence(to, from) });
    }
    return found;
  }

  ownersOf(env, later) {
    const { app } = this,
      of = app.recording || app,
      known = this.owners.get(env);
    if (known && known.of === of) return known.own;
    const entry = { of, own: new Set() };
    this.owners.set(env, entry);
    templateOwners(app, env).then(
      ({ own }) => {
        entry.own = own;
        later();
      },
      () => {}, // the domain is shown
    );
    return entry.own;
  }
}
