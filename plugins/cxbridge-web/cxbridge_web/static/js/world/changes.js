// The changed facts of the world model, in order: facts of the agent's own templates, domain-fact and
// wm-fact.
import { templateOwners } from "cx/clips/source.js";
import { parseFact, valuesOf } from "cx/clips/text.js";
import { Store } from "cx/stores.js";

const MOST_CHANGES = 20_000, // the oldest fifth makes room
  CORE_TEMPLATES = new Set(["domain-fact", "wm-fact"]), // templates of the core with facts about the world
  NAME_SLOTS = new Set(["id", "name", "key"]), // slots that name the subject of a fact
  COPY = /^\(wm-fact \(id "?\/domain\//, // copies of domain-facts (shown themselves) and domain-objects
  INTERFACE = /Interface$/; // templates of facts that the feature blackboard makes of interfaces

/**
 * A fact in words, e.g. "at robot1 lab".
 * @param old another fact of the template: of a fact of the agent's own templates, the slots that are equal in
 *   both are left out, except names
 */
function sentence(text, old = "") {
  const { template, slots } = (text && parseFact(text)) || {},
    words = (slot) => valuesOf(slots.get(slot)).join(" ");
  if (!slots) return text;
  if (template === "domain-fact") return (words("name") + " " + words("param-values")).trim();
  if (template === "wm-fact") return words("id") + " = " + (words("values") || words("value"));
  const before = parseFact(old)?.slots || new Map(),
    shownSlots = [...slots].filter(([slot, value]) => NAME_SLOTS.has(slot) || before.get(slot) !== value);
  return template + " " + shownSlots.map((pair) => pair.join(" ")).join(", ");
}

/**
 * Add a change {env, time, template, step, from, to}; a retraction and an assertion of a template at the same
 * time are one change.
 * @param step the number of events up to the change in a recording; 0 in a live run
 */
function addChange(list, { env, time_us: time, asserted, template, text }, step) {
  const last = list.at(-1),
    isSame = last && !last.to && last.time === time && last.template === template && last.env === env;
  if (asserted && isSame) {
    Object.assign(last, { to: text, step });
    if (last.from === text) list.pop(); // asserted anew without a change
  } else list.push({ env, time, template, step, from: asserted ? "" : text, to: asserted ? text : "" });
  if (list.length > MOST_CHANGES) list.splice(0, MOST_CHANGES / 5);
}

class ChangeStore extends Store {
  // environment -> {source, own}: the agent's own templates, and the run that named them
  ownTemplates = new Map();

  constructor(app) {
    super(app, (events = []) => {
      const list = [];
      for (const [at, event] of events.entries()) if (event.kind === "fact") addChange(list, event, at + 1);
      return list;
    });
    app.live.onEvent((event) => event.kind === "fact" && addChange(this.live, event, 0));
  }

  /**
   * The changes up to the moment, the latest first: {time, before, after}.
   * @param limit the maximum number of changes
   * @param onTemplatesKnown called when the agent's own templates are known
   */
  latest(limit, onTemplatesKnown) {
    const { recording, env, selection } = this.app,
      own = this.ownTemplatesOf(env, onTemplatesKnown),
      until = selection.value.time ?? Infinity,
      isRecorded = recording && !recording.isPast,
      list = this.now,
      sentences = [];
    for (let at = list.length - 1; at >= 0 && sentences.length < limit; at--) {
      const { step, time, template, env: changeEnv, from, to } = list[at],
        hasHappened = isRecorded ? step <= recording.at : time <= until,
        isOwn = own.has(template) && !INTERFACE.test(template),
        isWorld = CORE_TEMPLATES.has(template) ? !COPY.test(to || from) : isOwn;
      if (hasHappened && changeEnv === env && isWorld)
        sentences.push({ time, before: sentence(from, to), after: sentence(to, from) });
    }
    return sentences;
  }

  /** The agent's own templates, a Set; empty until they are known, and then `onTemplatesKnown` is called. */
  ownTemplatesOf(env, onTemplatesKnown) {
    const { app } = this,
      source = app.recording || app,
      known = this.ownTemplates.get(env);
    if (known?.source === source) return known.own;
    const templates = { source, own: new Set() };
    this.ownTemplates.set(env, templates);
    const storeOwn = ({ own }) => {
      templates.own = own;
      onTemplatesKnown();
    };
    templateOwners(app, env).then(storeOwn, () => {}); // without an answer, only CORE_TEMPLATES are shown
    return templates.own;
  }
}
export const changesOf = (app) => ChangeStore.of(app);
