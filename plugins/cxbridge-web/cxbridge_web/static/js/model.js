// The state of a live or recorded run at a moment, made from its events. Views are notified once a frame.
import { MAIN_ENV, bare, fields, goalKey, isUnnamed } from "cx/names.js";
import { History } from "cx/timeline/history.js";

// the greatest numbers of kept log lines, gone goals, shown calls and messages
const MOST_LOG = 20000,
  MOST_GONE = 2000,
  MOST_CALLS = 500,
  MOST_MESSAGES = 200;
// the topics of changes, which listeners get as a Set
const TOPICS = ["goals", "skills", "log", "interfaces", "facts", "rules", "messages"];

/** The slots in a goal's event, without its state, by the names of the API. */
export const slotsIn = ({ params, meta, priority, resources, slots }) => ({
  parameters: fields(params),
  meta: fields(meta),
  ...(priority && { priority }),
  "required-resources": fields(resources),
  ...slots,
});

export class Model {
  /**
   * @param onRetracted gets goals that are RETRACTED; without it, such goals are moved to `gone`
   * @param history the history of the whole run; without it, the history grows with the events
   */
  constructor(onRetracted = null, history = null) {
    this.onRetracted = onRetracted;
    this.isWhole = history !== null; // the history is that of the whole run
    this.history = history || new History();
    this.listeners = new Set(); // get the changed topics, once a frame
    this.watchers = new Set(); // get each event
    this.touched = new Set(); // topics that have changed since the last frame
    this.frame = 0;
    this.requestCount = 0; // the requests for lists that are under way
    this.eventsMeanwhile = []; // events of goals and facts since the first of these requests
    this.clear();
  }

  /**
   * Read a list. The list may be older than events that came during the request: these events are applied
   * again, to the model but not to the history.
   * @param ask() returns a promise of the answer
   * @param store(answer) stores the list in the model
   */
  async update(ask, store) {
    const { length } = this.eventsMeanwhile;
    this.requestCount += 1;
    try {
      store(await ask());
      for (const event of this.eventsMeanwhile.slice(length)) this["on_" + event.kind](event);
    } finally {
      this.requestCount -= 1;
      if (!this.requestCount) this.eventsMeanwhile = [];
    }
  }

  clear() {
    this.time = 0;
    this.step = 0; // the last step of the history that has happened at the moment
    if (!this.isWhole) this.history.clear();
    this.goals = new Map(); // key -> goal
    this.gone = new Map(); // key -> goal that has no fact any more, the oldest first
    this.log = [];
    this.logGone = 0; // the number of lines that were dropped from the log
    this.interfaces = new Map(); // uid -> {uid, time, writes, values}
    this.messages = [];
    this.facts = new Map(); // environment -> index -> fact
    this.firings = new Map(); // "ENVIRONMENT RULE" -> number
    for (const topic of TOPICS) this.touch(topic);
  }

  /** Call a function with the changed topics. Returns a function that ends this. */
  onChange(listener) {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
  /** Report a change of a topic in the next frame. */
  touch(topic) {
    this.touched.add(topic);
    this.frame ||= requestAnimationFrame(() => {
      const topics = this.touched;
      this.touched = new Set();
      this.frame = 0;
      for (const listener of [...this.listeners]) listener(topics);
    });
  }

  apply(event) {
    const { kind } = event,
      handler = !isUnnamed(event) && this["on_" + kind.replace("-", "_")]; // undefined for other kinds
    if (event.time_us > this.time) this.time = event.time_us;
    if (!this.isWhole) this.history.apply(event);
    this.step = this.isWhole ? event.step : this.history.steps;
    if (handler && this.requestCount && ["goal", "fact"].includes(kind)) this.eventsMeanwhile.push(event);
    if (handler) handler.call(this, event);
    for (const watcher of this.watchers) watcher(event);
  }
  /** Call a function with each event. Returns a function that ends this. */
  onEvent(watcher) {
    this.watchers.add(watcher);
    return () => this.watchers.delete(watcher);
  }

  keyOf(env, id) {
    return this.history.keyOf(env, id, this.step); // an id may be used again
  }
  /**
   * The goal that has an id now: a known goal, which is taken from the gone goals, or a new goal that is not
   * stored yet. Its `history` has its transitions up to now.
   */
  goalOf(env, name) {
    const key = this.keyOf(env, name),
      changes = () => this.changesOf({ key }),
      id = name + key.slice(goalKey(env, name).length), // ID#2 for an id that is used again
      known = this.goals.get(key) || this.gone.get(key);
    this.gone.delete(key);
    if (known) return known;
    return {
      ...{ key, id, name, env, details: null },
      get history() {
        return changes();
      },
    };
  }

  on_goal(event) {
    const goal = this.goalOf(event.env, event.goal),
      { goal_class: cls, mode, outcome, error } = event,
      parent = this.history.goals.get(goal.key)?.parent || "";
    Object.assign(goal, { cls, subType: bare(event.sub_type), parent, mode, outcome, error });
    goal.event = event;
    this.goals.set(goal.key, goal);
    // the fact of a RETRACTED goal may stay until its family is gone: a live page reads the goals again
    if (mode === "RETRACTED") (this.onRetracted || ((each) => this.bury(each)))(goal);
    this.touch("goals");
  }

  /** Move a goal to the gone goals. */
  bury(goal) {
    this.goals.delete(goal.key);
    this.gone.delete(goal.key);
    this.gone.set(goal.key, goal);
    const [oldest] = this.gone.keys();
    if (this.gone.size > MOST_GONE) this.gone.delete(oldest);
  }

  /**
   * Take the goals of an environment from the API: goals that the API lacks are gone, and RETRACTED goals of
   * other environments.
   * @param now the daemon's clock
   */
  goalsAre(list, env = MAIN_ENV, now = this.time) {
    const present = new Map();
    for (const details of list) {
      const goal = this.goalOf(env, details.id),
        { class: cls, "sub-type": subType = "", parent, mode, outcome, error = [] } = details;
      Object.assign(goal, { cls, subType, mode, outcome, error: error.join(" "), details });
      goal.parent = parent ? this.keyOf(env, parent) : "";
      present.set(goal.key, goal);
      // an event that came during the request is newer than the list
      if (this.eventsMeanwhile.some((event) => event.goal === details.id)) continue;
      const madeEvent = this.history.addMissingGoal(goal, now);
      if (madeEvent) for (const watcher of this.watchers) watcher(madeEvent);
    }
    for (const [key, goal] of this.goals) {
      if (present.has(key)) continue;
      if ((goal.env || MAIN_ENV) !== env && goal.mode !== "RETRACTED") present.set(key, goal);
      else this.bury(goal);
    }
    this.goals = present;
    this.touch("goals");
  }

  on_plan_action() {
    this.touch("goals");
  }
  on_skill() {
    this.touch("skills");
  }
  /** The skill calls that have begun, in order; of many, the last. */
  get calls() {
    const begun = this.history.calls.filter(({ begin }) => begin.step <= this.step);
    return begun.slice(-MOST_CALLS).map((call) => this.callNow(call));
  }
  /** A call of the history as it is at the moment. */
  callNow({ skiller, lane, text, msgid, status, error, guessed, begin, end }) {
    const isOver = end !== null && end.step <= this.step,
      state = isOver ? { status, error, end: end.time } : { status: "S_RUNNING", error: "", end: null };
    return { skiller, lane, text, msgid, guessed, begin: begin.time, ...state };
  }
  /** The changes of a goal up to the moment. */
  changesOf({ key }) {
    const known = this.history.goals.get(key);
    return known ? known.changes.filter(({ step }) => step <= this.step) : [];
  }

  on_log({ time_us: time, level, component, text }) {
    this.log.push({ number: this.logGone + this.log.length, time, level, component, text });
    if (this.log.length > MOST_LOG) {
      // the oldest tenth makes room
      this.logGone += MOST_LOG / 10;
      this.log.splice(0, MOST_LOG / 10);
    }
    this.touch("log");
  }

  on_interface({ uid, values, time_us: time }) {
    const known = this.interfaces.get(uid);
    this.interfaces.set(uid, {
      ...{ uid, time, writes: (known?.writes ?? 0) + 1 },
      values: { ...known?.values, ...values },
    });
    if (uid.startsWith("SkillerInterface::")) this.touch("skills");
    this.touch("interfaces");
  }

  on_message({ time_us: time, uid, message, sender, outcome, values }) {
    this.messages.push({ time, uid, message, sender, outcome, values });
    if (this.messages.length > MOST_MESSAGES) this.messages.shift();
    this.touch("messages");
  }

  factsOf(env) {
    if (!this.facts.has(env)) this.facts.set(env, new Map());
    return this.facts.get(env);
  }
  on_fact({ env, asserted, index, template, text }) {
    if (asserted) this.factsOf(env).set(index, { index, template, text });
    else this.factsOf(env).delete(index);
    this.touch("facts");
  }
  /** Take all facts of an environment from the API. */
  factsAre(env, list) {
    const factOf = ({ index, template_name: template, formatted: text }) => [
      index,
      { index, template, text },
    ];
    this.facts.set(env, new Map(list.map(factOf)));
    this.touch("facts");
  }

  on_rule({ env, rule }) {
    const key = env + " " + rule;
    this.firings.set(key, (this.firings.get(key) || 0) + 1);
    this.touch("rules");
  }
}
