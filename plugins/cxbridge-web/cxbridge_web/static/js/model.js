// What is known about a run: made of its events, live or recorded. Views are notified once a frame.
import { MAIN_ENV, bare, fields, goalKey, isUnnamed } from "cx/names.js";
import { History } from "cx/timeline/history.js";

export { MAIN_ENV, goalKey };
const MOST_LOG = 20000,
  MOST_GONE = 2000,
  MOST_CALLS = 500,
  MOST_MESSAGES = 200;

/** The slots of a goal that its event tells besides its state, by the names of the API. */
const toldBy = ({ params, meta, priority, resources, slots }) => ({
  parameters: fields(params),
  meta: fields(meta),
  ...(priority && { priority }),
  "required-resources": fields(resources),
  ...slots,
});

export class Model {
  /**
   * @param onRetracted gets the goals that are RETRACTED; without it they are gone then
   * @param history of the whole run, when it is known already; else it grows with the events
   */
  constructor(onRetracted = null, history = null) {
    this.onRetracted = onRetracted;
    this.isWhole = history !== null;
    this.history = history || new History();
    this.listeners = new Set();
    this.watchers = new Set();
    this.touched = new Set();
    this.frame = 0;
    this.asking = 0;
    this.meanwhile = [];
    this.clear();
  }

  /**
   * Ask for a list and take it. It may be older than events that came meanwhile: they are applied once
   * more, but happened once.
   * @param take called with the answer
   */
  async update(ask, take) {
    const { length } = this.meanwhile;
    this.asking += 1;
    try {
      take(await ask());
      for (const event of this.meanwhile.slice(length)) this["on_" + event.kind](event);
    } finally {
      this.asking -= 1;
      if (!this.asking) this.meanwhile = [];
    }
  }

  clear() {
    this.time = 0;
    this.step = 0; // of the history: what is beyond has not happened yet
    if (!this.isWhole) this.history.clear();
    this.goals = new Map();
    this.gone = new Map();
    this.actions = new Map(); // key of the goal -> key of the action -> action
    this.log = [];
    this.logGone = 0; // lines that made room for others
    this.interfaces = new Map();
    this.messages = [];
    this.facts = new Map(); // environment -> index -> fact
    this.firings = new Map();
    this.planners = [];
    for (const topic of ["goals", "skills", "log", "interfaces", "facts", "rules", "messages"])
      this.touch(topic);
  }

  onChange(listener) {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  touch(topic) {
    this.touched.add(topic);
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => {
      const topics = this.touched;
      this.touched = new Set();
      this.frame = 0;
      for (const listener of [...this.listeners]) listener(topics);
    });
  }

  apply(event) {
    if (event.time_us > this.time) this.time = event.time_us;
    if (!this.isWhole) this.history.apply(event);
    this.step = this.isWhole ? event.step : this.history.steps;
    if (this.asking && (event.kind === "goal" || event.kind === "fact")) this.meanwhile.push(event);
    const take = this["on_" + event.kind.replace("-", "_")];
    if (take && !isUnnamed(event)) take.call(this, event);
    for (const watcher of this.watchers) watcher(event);
  }

  /** Call with every event, as it comes. */
  onEvent(watcher) {
    this.watchers.add(watcher);
    return () => this.watchers.delete(watcher);
  }

  /** The key of the goal that has an id now: an id may be used again. */
  keyOf(env, id) {
    return this.history.keyOf(env, id, this.step);
  }

  on_goal(event) {
    const key = this.keyOf(event.env, event.goal);
    const goal = this.goals.get(key) || this.gone.get(key) || this.newGoal(key, event.goal, event.env);
    goal.cls = event.goal_class;
    goal.subType = bare(event.sub_type);
    goal.parent = this.history.goals.get(key)?.parent || "";
    goal.mode = event.mode;
    goal.outcome = event.outcome;
    goal.error = event.error;
    goal.told = toldBy(event);
    this.gone.delete(key);
    this.goals.set(key, goal);
    // its fact may stay until its family is gone: who can ask does, a recording only knows this much
    if (event.mode === "RETRACTED") {
      if (this.onRetracted) this.onRetracted(goal);
      else this.bury(goal);
    }
    this.touch("goals");
  }

  bury(goal) {
    this.goals.delete(goal.key);
    this.gone.delete(goal.key);
    this.gone.set(goal.key, goal);
    if (this.gone.size > MOST_GONE) {
      const [oldest] = this.gone.keys();
      this.gone.delete(oldest);
      this.actions.delete(oldest);
    }
  }

  /**
   * The goals of an environment as the API tells them: what it does not have is gone.
   * @param now the daemon's clock
   */
  goalsAre(list, env = MAIN_ENV, now = this.time) {
    const there = new Map();
    for (const each of list) {
      const key = this.keyOf(env, each.id),
        goal = this.goals.get(key) || this.gone.get(key) || this.newGoal(key, each.id, env);
      Object.assign(goal, {
        cls: each.class,
        subType: each["sub-type"] || "",
        parent: each.parent ? this.keyOf(env, each.parent) : "",
        mode: each.mode,
        outcome: each.outcome,
        error: (each.error || []).join(" "),
        details: each,
      });
      this.gone.delete(goal.key);
      there.set(goal.key, goal);
      if (this.meanwhile.some((event) => event.goal === each.id)) continue;
      const made = this.history.goalIs(goal, now);
      if (made) for (const watcher of this.watchers) watcher(made);
    }
    for (const [key, goal] of this.goals) {
      if (there.has(key)) continue;
      if ((goal.env || MAIN_ENV) !== env && goal.mode !== "RETRACTED") there.set(key, goal);
      else this.bury(goal);
    }
    this.goals = there;
    this.touch("goals");
  }

  on_plan_action(event) {
    const goal = this.keyOf(event.env, event.goal);
    if (!this.actions.has(goal)) this.actions.set(goal, new Map());
    const actions = this.actions.get(goal),
      key = event.plan + " " + event.action_id;
    const callOf = () => this.callOf(goal, { plan: event.plan, id: event.action_id });
    const action = actions.get(key) || {
      plan: event.plan,
      id: event.action_id,
      since: 0,
      /** Its last skill call up to now; null: none is known. */
      get call() {
        return callOf();
      },
      get skiller() {
        return callOf()?.skiller || "";
      },
    };
    action.name = event.action;
    action.values = fields(event.params);
    action.state = event.state;
    action.since = event.time_us;
    if (event.state === "EXECUTION-FAILED" || event.state === "FAILED") action.hasFailed = true;
    else if (event.state === "FORMULATED") action.hasFailed = false; // its goal is tried again
    actions.set(key, action);
    this.touch("goals");
  }

  on_skill() {
    this.touch("skills");
  }

  /** The skill calls up to now, the latest last. */
  get calls() {
    const begun = this.history.calls.filter(({ begin }) => begin.step <= this.step);
    return begun.slice(-MOST_CALLS).map((call) => this.callNow(call));
  }

  /** A skill call of the history as it is now. */
  callNow({ skiller, lane, text, msgid, status, error, guessed, begin, end }) {
    const isOver = end !== null && end.step <= this.step;
    return {
      skiller,
      lane,
      text,
      msgid,
      status: isOver ? status : "S_RUNNING",
      error: isOver ? error : "",
      guessed,
      begin: begin.time,
      end: isOver ? end.time : null,
    };
  }

  /** A goal; its transitions up to now are its `history`. */
  newGoal(key, name, env) {
    const changes = () => this.changesOf({ key });
    return {
      key,
      id: name + key.slice(goalKey(env, name).length), // of an id that is used again: ID#2
      name,
      env,
      details: null,
      get history() {
        return changes();
      },
    };
  }

  /** The last skill call of an action, as far as it has begun; null: none is known. */
  callOf(goal, { plan, id }) {
    const action = this.history.actionAt(goal, plan, id, this.step),
      call = action && action.calls.findLast(({ begin }) => begin.step <= this.step);
    return call ? this.callNow(call) : null;
  }

  /** The transitions of a goal up to now. */
  changesOf(goal) {
    const known = this.history.goals.get(goal.key);
    return known ? known.changes.filter(({ step }) => step <= this.step) : [];
  }

  on_log(event) {
    this.log.push({
      number: this.logGone + this.log.length,
      time: event.time_us,
      level: event.level,
      component: event.component,
      text: event.text,
    });
    if (this.log.length > MOST_LOG) {
      this.logGone += MOST_LOG / 10;
      this.log.splice(0, MOST_LOG / 10);
    }
    this.touch("log");
  }

  on_interface(event) {
    const known = this.interfaces.get(event.uid);
    const values = { ...(known ? known.values : {}), ...event.values };
    const changed = known
      ? Object.keys(event.values).filter((name) => String(known.values[name]) !== String(event.values[name]))
      : [];
    this.interfaces.set(event.uid, {
      uid: event.uid,
      values,
      changed: new Set(changed),
      time: event.time_us,
      writes: (known ? known.writes : 0) + 1,
    });
    if (event.uid.startsWith("SkillerInterface::")) this.touch("skills");
    this.touch("interfaces");
  }

  on_message(event) {
    this.messages.push({
      time: event.time_us,
      uid: event.uid,
      message: event.message,
      sender: event.sender,
      outcome: event.outcome,
      values: event.values,
    });
    if (this.messages.length > MOST_MESSAGES) this.messages.shift();
    this.touch("messages");
  }

  factsOf(env) {
    if (!this.facts.has(env)) this.facts.set(env, new Map());
    return this.facts.get(env);
  }

  on_fact(event) {
    const facts = this.factsOf(event.env);
    if (event.asserted)
      facts.set(event.index, { index: event.index, template: event.template, text: event.text });
    else facts.delete(event.index);
    this.touch("facts");
  }

  factsAre(env, list) {
    this.facts.set(
      env,
      new Map(
        list.map((fact) => [
          fact.index,
          { index: fact.index, template: fact.template_name, text: fact.formatted },
        ]),
      ),
    );
    this.touch("facts");
  }

  on_rule(event) {
    const key = event.env + " " + event.rule;
    this.firings.set(key, (this.firings.get(key) || 0) + 1);
    this.touch("rules");
  }

  on_planner(event) {
    this.planners.push(event);
    if (this.planners.length > MOST_CALLS) this.planners.shift();
  }
}
