// The history of a run: goals, plan-actions, skill calls and errors with their changes over time, read from
// events. Timeline, goals and reports take all times from here.
import { plural } from "cx/dom.js";
import { hasEnded, skillOutcome } from "cx/outcome.js";
import { MAIN_ENV, bare, countWhile, fields, goalKey, isUnnamed } from "cx/names.js";
import { agentAndId, BoardMessages, laneOf } from "cx/timeline/board.js";

// the oldest entries of full lists are dropped
const MOST_GOALS = 20000,
  MOST_CALLS = 20000,
  MOST_MARKS = 20000,
  MOST_CHANGES = 400; // of a goal or an action, see append()
const SKILLER = "SkillerInterface::",
  EXECUTOR = "SkillExecutorInterface::",
  NOT_SENT = new Set(["FORMULATED", "PENDING"]); // states of an action before its skill is requested

/** A moment: microseconds, and the number of transitions up to then. */
const pointAt = (time, step) => ({ time, step });

/** Append a change; of more than MOST_CHANGES the first and the latest stay. */
function append(changes, change) {
  changes.push(change);
  if (changes.length > MOST_CHANGES) changes.splice(1, 1);
}

/** The last element of an ordered list at or before a step; undefined if there is none. */
export const lastUpTo = (list, step, stepOf = (each) => each.step) =>
  list[countWhile(list, (each) => stepOf(each) <= step) - 1];
/** The last goal or action that began at or before a step. */
const lifeAt = (lives, step) => lastUpTo(lives, step, ({ changes }) => changes[0]?.step ?? Infinity);

/** The actions or sub-goals of a goal's last attempt up to a step: a goal may be tried again. */
export function ofLastAttempt({ changes }, items, step = Infinity) {
  const past = changes.slice(
      0,
      countWhile(changes, (each) => each.step <= step),
    ),
    // an ended goal is open again, or a goal is formulated again
    isAgain = ({ mode }, at) =>
      at > 0 &&
      (hasEnded(past[at - 1].mode) ? !hasEnded(mode) : mode === "FORMULATED" && past[at - 1].mode !== mode),
    since = past[past.findLastIndex(isAgain) - 1]?.step ?? 0;
  return items.filter((item) => lastUpTo(item.changes, step)?.step >= since);
}

/** Drop the oldest twentieth of a full list. */
function dropOldest(list, most) {
  if (list.length > most) list.splice(0, most / 20);
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
    this.goals = new Map(); // key -> goal
    this.actions = new Map(); // key -> plan-action
    this.actionLives = new Map(); // goal, plan and id -> the plan-actions with them, in order
    this.lives = new Map(); // goalKey -> the goals with this id, in order
    this.skillerCalls = []; // calls in SkillerInterfaces and in events of executives
    this.boardCalls = []; // calls in the messages of skill boards
    this.planners = []; // calls of planners
    this.errors = []; // log lines of level error
    this.begin = null; // the time of the first event
    this.time = 0; // the time of the latest event
    this.steps = 0; // the number of transitions
    this.revision = (this.revision || 0) + 1; // counts changes
    this.shape = (this.shape || 0) + 1; // counts changes of the rows
    this.nextCall = 0; // the number of the next call
    this.lastCalls = new Map(); // lane -> its last call
    this.skillers = new Map(); // id -> values of the interface
    this.executors = new Map(); // lane -> {}: the known executors of skill boards
    this.executiveLanes = new Set(); // lanes with events of an executive
    this.board = new BoardMessages();
    this.openPlannerCalls = new Map(); // environment and number -> a planner's call that is under way
    this.stepTimes = []; // the time of each step
  }

  /**
   * The skill calls, in order. Calls of a skill board are also calls of its Skillers: if there are both, only
   * the board's count, unless executives report the calls of Skillers.
   */
  get calls() {
    const { skillerCalls, boardCalls } = this;
    return skillerCalls.length && (this.executiveLanes.size || !boardCalls.length)
      ? skillerCalls
      : boardCalls;
  }

  /** The moment of the latest event. */
  get end() {
    return pointAt(this.time, this.steps);
  }

  /** Whether a goal or a skill call is open. */
  get hasOpenItems() {
    if (this.checkedRevision !== this.revision) {
      this.checkedRevision = this.revision;
      const isOpen = ({ changes }) => !hasEnded(changes.at(-1).mode);
      this.cachedHasOpenItems =
        [...this.lastCalls.values()].some(({ end }) => !end) || [...this.goals.values()].some(isOpen);
    }
    return this.cachedHasOpenItems;
  }

  apply(event) {
    const handler = this["on_" + event.kind.replace("-", "_")];
    this.time = Math.max(this.time, event.time_us);
    this.begin ??= event.time_us;
    if (!handler || isUnnamed(event)) return;
    handler.call(this, event);
    this.revision += 1;
  }

  /** Count a transition, and return its moment. */
  step() {
    this.steps += 1;
    this.stepTimes.push(this.time);
    return this.end;
  }
  /** How many steps there were up to a time. */
  stepsUpTo(time) {
    return countWhile(this.stepTimes, (each) => each <= time);
  }

  /** The key of the goal with an id at a step: several goals may use an id one after the other. */
  keyOf(env, id, step = Infinity) {
    const key = goalKey(env, id),
      known = this.lives.get(key);
    return known ? (lifeAt(known, step) || known[0]).key : key;
  }

  on_goal(event) {
    const bareKey = goalKey(event.env, event.goal),
      lives = this.lives.get(bareKey) || [];
    let goal = lives.at(-1);
    if (!goal || (event.is_new && !goal.isMadeUp)) {
      // a new goal with an id that was used before is ID#2
      const life = goal ? goal.life + 1 : 1,
        suffix = life > 1 ? "#" + life : "",
        env = event.env || MAIN_ENV;
      goal = { kind: "goal", key: bareKey + suffix, life, id: event.goal + suffix, env };
      Object.assign(goal, { isMadeUp: Boolean(event.isMadeUp), parent: "", changes: [], actions: [] });
      this.lives.set(bareKey, [...lives, goal]);
      this.goals.set(goal.key, goal);
      this.shape += 1;
      if (this.goals.size > MOST_GOALS) this.forgetRetracted();
    }
    // a later goal may use the parent's id: the goal stays below its first parent
    if (goal.parentId !== event.parent) {
      goal.parentId = event.parent;
      goal.parent = bare(event.parent || "") ? this.keyOf(event.env, event.parent) : "";
      this.shape += 1;
    }
    Object.assign(goal, { cls: event.goal_class, subType: bare(event.sub_type || "") });
    const last = goal.changes.at(-1),
      { mode, outcome, error = "" } = event;
    if (last?.mode !== mode || last.outcome !== outcome)
      append(goal.changes, { ...this.step(), mode, outcome, error });
    else if (error) last.error = error;
  }

  /** Drop the oldest retracted goals with their actions, 5 % at once. */
  forgetRetracted() {
    for (const [key, goal] of this.goals) {
      if (goal.changes.at(-1).mode !== "RETRACTED") continue;
      this.goals.delete(key);
      for (const action of goal.actions) {
        this.actions.delete(action.key);
        this.actionLives.delete(action.goal + "\n" + action.plan + " " + action.id);
      }
      if (this.goals.size <= MOST_GOALS * 0.95) break;
    }
    for (const [id, lives] of this.lives) {
      const kept = lives.filter((goal) => this.goals.has(goal.key));
      if (kept.length) this.lives.set(id, kept);
      else this.lives.delete(id);
    }
  }

  /**
   * Add a goal of the API's list whose events are missing.
   * @returns an event in place of the missing events; null for a known goal in this mode, and for a known
   * goal if the history has later events
   */
  addMissingGoal({ name, env, cls, subType, parent, mode, outcome, error }, time) {
    const known = this.goals.get(this.keyOf(env, name)),
      last = known && known.changes.at(-1);
    if (last && (last.mode === mode || this.time > time)) return null;
    const event = {
      ...{ kind: "goal", time_us: Math.max(time, this.time), env, goal: name, goal_class: cls },
      ...{ sub_type: subType, parent, mode, outcome, error, isMadeUp: true },
    };
    this.apply(event);
    return event;
  }

  /**
   * Apply a change of a plan-action. A second attempt of the goal may use the ids for another action or other
   * parameters: then the key of its action ends with #2.
   */
  on_plan_action({ env, goal, plan, action_id: id, action: name, params = "", ...event }) {
    const goalKeyNow = this.keyOf(env, goal),
      baseKey = goalKeyNow + "\n" + plan + " " + id,
      lives = this.actionLives.get(baseKey) || [];
    let action = lives.at(-1);
    if (!action || action.name !== name || (action.params && params && action.params !== params)) {
      const suffix = lives.length ? "#" + (lives.length + 1) : "";
      action = {
        kind: "action",
        key: baseKey + suffix,
        path: plan + " " + id + suffix,
        goal: goalKeyNow,
        plan,
        id,
        name,
      };
      const text = [name, ...fields(params)].join(" ");
      Object.assign(action, { params, text, env: env || MAIN_ENV, changes: [], calls: [] });
      this.actionLives.set(baseKey, [...lives, action]);
      this.actions.set(action.key, action);
      this.goals.get(goalKeyNow)?.actions.push(action);
      this.shape += 1;
    }
    append(action.changes, { ...this.step(), state: event.state });
    if (!event.call) return;
    // message numbers are used again: a call before the action's request belongs to another action
    const since = action.changes.findLast(({ state }) => NOT_SENT.has(state))?.step ?? 0,
      sentAs = event.skiller + "\n" + event.call,
      isOf = (call) => call.sentAs === sentAs && call.begin.step >= since && (!call.env || call.env === env);
    this.link(action, this.skillerCalls.findLast(isOf) || this.boardCalls.findLast(isOf));
  }

  /**
   * Link a skill call to its action.
   * @param guessed whether the link is a guess of cxbridge/history/linking.py, for lack of a record
   */
  link(action, call, guessed = false) {
    if (!action || !call || call.action) return;
    call.action = action;
    call.guessed = guessed;
    action.calls.push(call);
    this.revision += 1;
  }

  /** Add guessed links: rows of environment, goal, plan, action; Skiller, text, message, begin. */
  linkGuessed(rows) {
    for (const [env, goal, plan, id, skiller, text, msgid, begin] of rows) {
      const lives = this.lives.get(goalKey(env, goal)) || [{ key: goalKey(env, goal) }],
        distance = (call) => Math.abs(call.begin.time - begin),
        isOf = (call) => call.text === text && call.msgid === msgid && call.skiller === skiller,
        [call] = this.calls.filter(isOf).sort((a, b) => distance(a) - distance(b)),
        actions = lives.flatMap(({ key }) => this.actionLives.get(key + "\n" + plan + " " + id) || []);
      this.link(
        actions.findLast(({ changes }) => changes[0].time <= begin),
        call,
        true,
      );
    }
  }

  /** Apply the state of a Skiller as an executive sees it. */
  on_skill(event) {
    const { env, skiller } = event,
      ownLane = env && env !== MAIN_ENV ? env + "/" + skiller : skiller,
      // a Skiller without an agent in its id, which several executives use
      isShared = this.skillers.has(skiller) && !this.skillers.has(ownLane) && !this.lastCalls.has(ownLane),
      lane = isShared ? skiller : ownLane,
      lastCall = this.lastCalls.get(lane);
    // the times of a lane are those of its executive, as soon as there is one
    if (!this.executiveLanes.has(lane) && lastCall && !lastCall.end) lastCall.begin = this.step();
    this.executiveLanes.add(lane);
    this.applySkillState({ lane, ...event }, event.error);
  }

  /**
   * Apply a state of a lane, from the interface of a Skiller, an executive's event or a skill board. A lane
   * runs one skill at a time, and each of its calls has a message number.
   * @param request the name or number of a request to a skill board; undefined for a Skiller
   */
  applySkillState({ skiller, skill_string: text, msgid, status, env = "", lane, request }, error = "") {
    const last = this.lastCalls.get(lane),
      isSame = last && last.msgid === msgid && last.text === text,
      outcome = skillOutcome(status),
      isRunning = outcome === "running";
    if (!last && !isRunning) {
      // the interface still holds a call of an earlier run
      this.lastCalls.set(lane, { text, msgid, end: this.end });
      return;
    }
    if (isSame && !(last.end && isRunning)) {
      if (!last.end && !isRunning) this.endCall(last, outcome === "formulated" ? "stopped" : status, error);
      if (error && outcome === "failed") last.error = error;
      return;
    }
    if (last && !last.end) this.endCall(last, "stopped");
    if (!text || outcome === "formulated") return;
    const isOfBoard = request !== undefined,
      calls = isOfBoard ? this.boardCalls : this.skillerCalls,
      // identifies the request: its name or number on a skill board, or the Skiller and the message number
      sentAs = isOfBoard ? "\n" + request : skiller + "\n" + msgid,
      call = { kind: "skill", number: this.nextCall++, skiller, env, text, msgid, status, lane, sentAs };
    Object.assign(call, { begin: this.step(), end: null, error: "", action: null });
    calls.push(call);
    this.lastCalls.set(lane, call);
    this.shape += 1;
    if (!isRunning) this.endCall(call, status, error);
    dropOldest(calls, MOST_CALLS);
  }

  endCall(call, status, error = "") {
    call.status = status;
    call.end = this.step();
    const values = this.skillers.get(call.lane) || this.skillers.get(call.skiller);
    call.error = skillOutcome(status) === "failed" ? error || (values && values.error) || "" : "";
  }

  on_interface({ uid, values: changedValues }) {
    if (uid.startsWith(EXECUTOR)) this.storeRobot(this.executors, laneOf(...agentAndId(uid)));
    if (!uid.startsWith(SKILLER)) return;
    const [env, skiller] = agentAndId(uid),
      id = env ? env + "/" + skiller : skiller,
      values = { ...this.skillers.get(id), ...changedValues };
    this.storeRobot(this.skillers, id, values);
    const lane = this.laneOfSkiller(id),
      last = this.lastCalls.get(lane);
    // the executive reads the interface a loop later, before its plan-actions change: use the executive's
    // time
    if (!this.executiveLanes.has(lane)) this.applySkillState({ ...values, skiller, env, lane }, values.error);
    else if (last?.end?.time === this.time && skillOutcome(last.status) === "failed")
      last.error ||= values.error;
  }
  /** Store the values of a robot; a new robot is a new row. */
  storeRobot(map, lane, values = {}) {
    if (!map.has(lane)) this.shape += 1;
    map.set(lane, values);
  }
  /** The lane of a Skiller's calls: its id, perhaps behind the name of its agent. */
  laneOfSkiller(id) {
    const lanes = [...this.lastCalls.keys()];
    return this.lastCalls.has(id) ? id : lanes.find((lane) => lane.endsWith("/" + id)) || id;
  }
  /** A Map of the robots: lane -> calls, [] for a robot without calls. */
  get lanes() {
    const { calls } = this,
      lanes = new Map(Map.groupBy(calls, (call) => call.lane)),
      robots = calls === this.boardCalls && calls.length ? this.executors : this.skillers;
    for (const id of robots.keys()) {
      const lane = robots === this.skillers ? this.laneOfSkiller(id) : id;
      if (!lanes.has(lane)) lanes.set(lane, []);
    }
    return lanes;
  }

  on_message(event) {
    for (const change of this.board.read(event)) {
      const { type, agent, executor, request, text, progress, status, hasSucceeded } = change,
        lane = laneOf(agent, executor),
        call = this.lastCalls.get(lane);
      if (type === "CONFIRM") {
        const skillState = {
          skiller: executor,
          skill_string: text,
          msgid: event.msgid,
          env: agent,
          lane,
          request,
        };
        this.applySkillState({ ...skillState, status: "S_RUNNING" });
      } else if (!call || call.end || call.sentAs !== "\n" + request) continue;
      else if (type === "FEEDBACK") {
        call.feedbacks = (call.feedbacks || 0) + 1;
        const lastFeedback = (Math.round(progress * 100) + "% " + status).trimEnd();
        call.text = text + ": " + plural(call.feedbacks, "feedback message") + ", the last: " + lastFeedback;
      } else if (type === "FINISH")
        this.endCall(call, hasSucceeded ? "S_FINAL" : "S_FAILED", hasSucceeded ? "" : status);
    }
  }

  on_planner({ env, call, planner: name, goal, problem: text = "", status, reason }) {
    const key = env + " " + call;
    let plannerCall = this.openPlannerCalls.get(key);
    if (!plannerCall) {
      plannerCall = {
        kind: "planner",
        number: this.planners.length,
        name,
        goal,
        begin: this.step(),
        end: null,
        text,
      };
      this.planners.push(plannerCall);
    }
    plannerCall.status = status;
    this.openPlannerCalls.set(key, plannerCall);
    if (status === "started") return;
    this.openPlannerCalls.delete(key);
    plannerCall.end = this.step();
    if (reason) plannerCall.text = reason;
  }

  on_log({ level, component, text }) {
    if (level !== "E") return;
    this.errors.push({ kind: "error", ...this.end, level, component, text });
    dropOldest(this.errors, MOST_MARKS);
  }

  callOf(number) {
    return this.calls.find((call) => call.number === number);
  }
}
