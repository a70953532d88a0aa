// What happened when: goals, plan-actions, skill calls and errors with their changes over time, read from events.
// The one reader of such times: the timeline, the goals' view and reports take them from here.
import { skillOutcome } from "../outcome.js";
import { MAIN_ENV, bare, goalKey } from "../names.js";
import { BoardMessages } from "./board.js";

const MOST_GOALS = 20000,
  MOST_CALLS = 20000,
  MOST_MARKS = 20000,
  MOST_CHANGES = 400;
const LOOPS_US = 100_000; // some loops: what ends within them ends together
const SKILLER = "SkillerInterface::";

/** A moment: microseconds, and how many transitions there were up to then. */
const pointAt = (time, step) => ({ time, step });

/** Append a change; of very many the first and the latest stay. */
function append(changes, change) {
  changes.push(change);
  if (changes.length > MOST_CHANGES) changes.splice(1, 1);
}

const compare = (a, b) => a.map((each, at) => each - b[at]).find((each) => each !== 0) || 0;

/** The last of what is in order at or before a step. */
export function lastUpTo(list, step, stepOf = (each) => each.step) {
  let low = 0,
    high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (stepOf(list[middle]) <= step) low = middle + 1;
    else high = middle;
  }
  return list[low - 1];
}

export class History {
  constructor() {
    this.clear();
  }

  static of(events) {
    const history = new History();
    for (const event of events) history.apply(event);
    return history;
  }

  clear() {
    this.goals = new Map();
    this.actions = new Map();
    this.calls = [];
    this.planners = [];
    this.errors = []; // log lines of level error
    this.begin = null;
    this.time = 0;
    this.steps = 0;
    this.revision = (this.revision || 0) + 1; // something changed
    this.shape = (this.shape || 0) + 1; // there are other rows
    this.nextCall = 0;
    this.lastCalls = new Map();
    this.waiting = new Set();
    this.skillers = new Map(); // what their interfaces hold
    this.board = new BoardMessages();
    this.planning = new Map();
    this.stepTimes = []; // the time of each step
  }

  /** The latest moment. */
  get end() {
    return pointAt(this.time, this.steps);
  }

  /** Whether a goal or a skill call is not over yet. */
  get goesOn() {
    if (this.askedAt !== this.revision) {
      this.askedAt = this.revision;
      const isOpen = ({ changes }) => !["FINISHED", "EVALUATED", "RETRACTED"].includes(changes.at(-1).mode);
      this.isOn =
        [...this.lastCalls.values()].some(({ end }) => !end) || [...this.goals.values()].some(isOpen);
    }
    return this.isOn;
  }

  apply(event) {
    const take = this["on_" + event.kind.replace("-", "_")];
    this.time = Math.max(this.time, event.time_us);
    this.begin ??= event.time_us;
    if (!take) return;
    take.call(this, event);
    this.revision += 1;
  }

  /** A transition happened. Returns its moment. */
  step() {
    this.steps += 1;
    this.stepTimes.push(this.time);
    return this.end;
  }
  /** How many steps there were up to a time. */
  stepsUpTo(time) {
    let low = 0,
      high = this.stepTimes.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.stepTimes[middle] <= time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  on_goal(event) {
    const key = goalKey(event.env, event.goal);
    let goal = this.goals.get(key);
    if (!goal) {
      goal = {
        kind: "goal",
        key,
        id: event.goal,
        env: event.env || MAIN_ENV,
        parent: "",
        changes: [],
        actions: [],
      };
      this.goals.set(key, goal);
      this.shape += 1;
      if (this.goals.size > MOST_GOALS) this.forget();
    }
    const parent = event.parent && bare(event.parent) ? goalKey(event.env, event.parent) : "";
    if (parent !== goal.parent) this.shape += 1;
    Object.assign(goal, { cls: event.goal_class, subType: bare(event.sub_type || ""), parent });
    const last = goal.changes.at(-1),
      { mode, outcome } = event,
      error = event.error || "";
    if (last && last.mode === mode && last.outcome === outcome) {
      if (error) last.error = error;
    } else append(goal.changes, { ...this.step(), mode, outcome, error });
  }

  /** The oldest goals that are over make room. */
  forget() {
    for (const [key, goal] of this.goals) {
      if (goal.changes.at(-1).mode !== "RETRACTED") continue;
      this.goals.delete(key);
      for (const action of goal.actions) this.actions.delete(action.key);
      if (this.goals.size <= MOST_GOALS * 0.95) break;
    }
  }

  /**
   * A goal of a list that was asked for: events that came before the page was opened may be missing.
   * @returns the event that is made up for what was missed; null when there is nothing new
   */
  goalIs({ id, env, cls, subType, parent, mode, outcome, error }, time) {
    const known = this.goals.get(goalKey(env, id)),
      last = known && known.changes.at(-1);
    if (last && (last.mode === mode || this.time > time)) return null;
    const event = {
      kind: "goal",
      time_us: Math.max(time, this.time),
      env,
      goal: id,
      goal_class: cls,
      sub_type: subType,
      parent,
      mode,
      outcome,
      error,
    };
    this.apply(event);
    return event;
  }

  on_plan_action(event) {
    const goalOf = goalKey(event.env, event.goal),
      path = event.plan + " " + event.action_id,
      key = goalOf + "\n" + path;
    let action = this.actions.get(key);
    if (!action) {
      action = {
        kind: "action",
        key,
        path,
        goal: goalOf,
        plan: event.plan,
        id: event.action_id,
        name: event.action,
        env: event.env || MAIN_ENV,
        changes: [],
        maybe: [],
      };
      this.actions.set(key, action);
      const goal = this.goals.get(goalOf);
      if (goal) goal.actions.push(action);
      this.shape += 1;
    }
    append(action.changes, { ...this.step(), state: event.state });
    if (event.state === "PENDING" || event.state === "WAITING") this.waiting.add(action);
    else if (event.state === "RUNNING") action.ran = this.end;
    if (!["PENDING", "WAITING", "RUNNING"].includes(event.state)) this.waiting.delete(action);
  }

  on_skill(event) {
    this.skillIs(event, event.error);
  }

  /**
   * A Skiller says so itself, or the executive has read it there: the same call has the same message.
   * `lane`: what runs one skill at a time; a Skiller.
   */
  skillIs({ skiller, skill_string: text, msgid, status, env = "", lane = skiller }, error = "") {
    const last = this.lastCalls.get(lane),
      isSame = last && last.msgid === msgid && last.text === text,
      outcome = skillOutcome(status),
      isRunning = outcome === "running";
    if (!last && !isRunning) {
      // a Skiller that was used before still shows what it did last
      this.lastCalls.set(lane, { text, msgid, end: this.end });
      return;
    }
    if (isSame) {
      if (!last.end && !isRunning) this.endCall(last, outcome === "formulated" ? "stopped" : status, error);
      if (error && outcome === "failed") last.error = error;
      return;
    }
    if (last && !last.end) this.endCall(last, "stopped");
    if (!text || outcome === "formulated") return;
    const call = {
      kind: "skill",
      number: this.nextCall++,
      skiller,
      env,
      text,
      msgid,
      status,
      begin: this.step(),
      end: null,
      error: "",
      candidates: [...this.waiting],
    };
    for (const action of call.candidates) action.maybe.push(call);
    this.calls.push(call);
    this.lastCalls.set(lane, call);
    this.shape += 1;
    if (!isRunning) this.endCall(call, status, error);
    if (this.calls.length > MOST_CALLS) this.calls.splice(0, MOST_CALLS / 20);
  }

  endCall(call, status, error = "") {
    call.status = status;
    call.end = this.step();
    const held = this.skillers.get(call.skiller);
    call.error = skillOutcome(status) === "failed" ? error || (held && held.error) || "" : "";
  }

  on_interface(event) {
    if (!event.uid.startsWith(SKILLER)) return;
    const skiller = event.uid.slice(SKILLER.length),
      held = { ...this.skillers.get(skiller), ...event.values };
    this.skillers.set(skiller, held);
    this.skillIs({ skiller, ...held }, held.error);
  }

  on_message(event) {
    for (const { type, executor, text, progress, status, succeeded } of this.board.read(event)) {
      const call = this.lastCalls.get(executor);
      if (type === "CONFIRM") {
        const { msgid } = event;
        this.skillIs({ skiller: executor, skill_string: text, msgid, status: "S_RUNNING", env: event.env });
      } else if (!call || call.end) continue;
      else if (type === "FEEDBACK") {
        call.feedbacks = (call.feedbacks || 0) + 1;
        const last = (Math.round(progress * 100) + "% " + status).trimEnd();
        call.text = text + ": " + call.feedbacks + " times feedback, the last: " + last;
      } else if (type === "FINISH")
        this.endCall(call, succeeded ? "S_FINAL" : "S_FAILED", succeeded ? "" : status);
    }
  }

  on_planner(event) {
    const key = event.env + " " + event.call;
    let span = this.planning.get(key);
    this.planning.delete(key);
    if (!span) {
      span = { kind: "planner", number: this.planners.length, name: event.planner, goal: event.goal };
      Object.assign(span, { begin: this.step(), end: null, status: "started", text: event.problem || "" });
      this.planners.push(span);
    }
    if (event.status === "started") this.planning.set(key, span);
    else {
      Object.assign(span, { end: this.step(), status: event.status });
      if (event.reason) span.text = event.reason;
    }
  }

  on_log(event) {
    if (event.level !== "E") return;
    this.errors.push({
      kind: "error",
      ...this.end,
      level: event.level,
      component: event.component,
      text: event.text,
    });
    if (this.errors.length > MOST_MARKS) this.errors.splice(0, MOST_MARKS / 20);
  }

  /**
   * The action that a call was for. Events do not say it: it is one that waited when the skill began, and ran
   * before it was over. When several could be, the one that ended with the skill, then one of the skill's name,
   * then the one that waited longest.
   */
  actionOf(call) {
    if (call.settled !== undefined) return call.settled;
    const until = call.end ? call.end.step : Infinity,
      found = call.candidates.filter(({ ran }) => ran && ran.step >= call.begin.step && ran.step <= until),
      name = /^\w*/.exec(call.text)[0],
      overOf = ({ changes }) => changes.find(({ state }) => /^EXECUTION-|^FAILED|^FINAL/.test(state));
    // the executive reads the end of a skill a loop after it was written
    const late = (action) => {
      const over = overOf(action);
      return call.end && over ? Math.round(Math.abs(over.time - call.end.time) / LOOPS_US) : 1e9;
    };
    const rank = (action) => [
      late(action),
      action.name.replace(/^!/, "") === name ? 0 : 1,
      action.changes[0].step,
    ];
    const [best = null] = found.sort((a, b) => compare(rank(a), rank(b)));
    if (call.end && this.steps > call.end.step + 20) call.settled = best;
    return best;
  }
  /** The skill calls of an action, in order. */
  callsOf(action) {
    return action.maybe.filter((call) => this.actionOf(call) === action);
  }
  callOf(number) {
    const at = number - (this.calls.length ? this.calls[0].number : 0);
    return this.calls[at];
  }
}
