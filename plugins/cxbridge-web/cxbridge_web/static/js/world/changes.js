// The changed facts of the world model, in order: facts of the agent's own templates, domain-fact and wm-fact.
import { templateOwners } from "cx/clips/source.js";
import { parseFact, valuesOf } from "cx/clips/text.js";
import { Store } from "cx/stores.js";

const MOST = 20_000,
  SHARED = new Set(["domain-fact", "wm-fact"]), // templates of the core with facts about the world
  NAMES = new Set(["id", "name", "key"]),
  COPY = /^\(wm-fact \(id "?\/domain\//, // a copy of a domain-fact, which is shown itself
  READ = /Interface$/; // facts about interfaces

/** A fact in words, e.g. "at robot1 lab". @param old another fact of the template; equal slots are left out */
function sentence(text, old = "") {
  const { template, slots } = (text && parseFact(text)) || {},
    words = (slot) => valuesOf(slots.get(slot)).join(" ");
  if (!slots) return text;
  if (template === "domain-fact") return (words("name") + " " + words("param-values")).trim();
  if (template === "wm-fact") return words("id") + " = " + (words("values") || words("value"));
  const before = parseFact(old)?.slots || new Map(),
    told = [...slots].filter(([slot, value]) => NAMES.has(slot) || before.get(slot) !== value);
  return template + " " + told.map((pair) => pair.join(" ")).join(", ");
}

/** Add a change; a retraction and an assertion of a template at the same time are one change. */
function take(list, { env, time_us: time, asserted, template, text }, step) {
  const last = list.at(-1),
    isSame = last && !last.to && last.time === time && last.template === template && last.env === env;
  if (asserted && isSame) {
    Object.assign(last, { to: text, step });
    if (last.from === text) list.pop(); // asserted anew without a change
  } else list.push({ env, time, template, step, from: asserted ? "" : text, to: asserted ? text : "" });
  if (list.length > MOST) list.splice(0, MOST / 5);
}

class ChangeStore extends Store {
  owners = new Map(); // environment -> the agent's own templates

  constructor(app) {
    super(app, (events = []) => {
      const list = [];
      for (const [at, event] of events.entries()) if (event.kind === "fact") take(list, event, at + 1);
      return list;
    });
    app.live.onEvent((event) => event.kind === "fact" && take(this.live, event, 0));
  }

  /**
   * The changes up to the moment, the latest first: {time, before, after}.
   * @param later called when the agent's own templates are known
   */
  latest(most, later) {
    const { recording, env, selection } = this.app,
      own = this.ownersOf(env, later),
      until = selection.value.time ?? Infinity,
      isRecorded = recording && !recording.isPast,
      list = this.now,
      found = [];
    for (let at = list.length - 1; at >= 0 && found.length < most; at--) {
      const { step, time, template, env: of, from, to } = list[at],
        isOver = isRecorded ? step <= recording.at : time <= until,
        isOwn = own.has(template) && !READ.test(template),
        isWorld = SHARED.has(template) ? !COPY.test(to || from) : isOwn;
      if (isOver && of === env && isWorld)
        found.push({ time, before: sentence(from, to), after: sentence(to, from) });
    }
    return found;
  }

  ownersOf(env, later) {
    const { app } = this,
      of = app.recording || app,
      known = this.owners.get(env);
    if (known?.of === of) return known.own;
    const entry = { of, own: new Set() };
    this.owners.set(env, entry);
    const learn = ({ own }) => {
      entry.own = own;
      later();
    };
    templateOwners(app, env).then(learn, () => {}); // without an answer, only the domain is shown
    return entry.own;
  }
}
export const changesOf = (app) => ChangeStore.of(app);
