// The panel beside the timeline and the table of goals: the chosen goal, action or skill call with its why,
// or the story of the run.
import { escapePart, get, throttled } from "cx/api.js";
import {
  button,
  clockText,
  dim,
  durationText,
  el,
  link,
  listSection,
  none,
  note,
  pairs,
  refill,
} from "cx/dom.js";
import { readModels } from "cx/env.js";
import { lineFilter } from "cx/log_lines.js";
import { slotsIn } from "cx/model.js";
import { MAIN_ENV } from "cx/names.js";
import { actionOutcome, goalOutcome, goalText, isOpen, outcomeBadge } from "cx/outcome.js";
import { causes, errorOf, forestOf, isBlocked } from "cx/story/causes.js";
import { chain, Story } from "cx/story/story.js";
import { lastUpTo } from "cx/timeline/history.js";
import { pathTo, resolve } from "cx/timeline/host.js";
import { outcomeAt, timesOf } from "cx/timeline/spans.js";
import { canAsk, showAnswer } from "cx/why.js";

const MAX_ENTRIES = 200, // entries of a list
  MAX_LOG_LINES = 8, // of the log
  FOLD_FROM_CHANGES = 12, // a list of this many or more changes is folded
  MIN_REDRAW_MS = 500, // the shortest time between two drawings of the same item
  LATE_US = 200_000, // log lines about an end come after the end
  PLANS_MS = 1000; // the shortest time between two requests for plans
// slots of a goal that are shown elsewhere or not at all
const OMITTED_SLOTS = new Set(
  (
    "kind apiVersion id class type sub-type parent mode outcome error plans priority parameters meta message " +
    "required-resources acquired-resources"
  ).split(" "),
);
// the default values of slots
const DEFAULT_VALUES = new Set(["", "0", "nil", "FALSE", "DEFAULT"]);
/** The value or values of a slot as a text; a single string without its quotes. */
const words = (values) =>
  Array.isArray(values) ? values.join(" ") : String(values ?? "").replace(/^"(.*)"$/s, "$1");
/** The text of a slot; empty for a default value. */
const nonDefaultText = (values) => (DEFAULT_VALUES.has(words(values)) ? "" : words(values));
const errorBox = (text) => (text ? el("p.error-box", text) : null);

const CONNECTIVES = { conjunction: "and", disjunction: "or", negation: "not" };
/** A grounded condition of the API as a tree, which marks the false parts. */
function conditionTree({ type, name, child = [], "param-values": values = [], "is-satisfied": isTrue }) {
  if (type === "atom" && child.length) return conditionTree(child[0]); // a formula that only wraps its atom
  const text = child.length ? CONNECTIVES[type] || type : "(" + [name, ...values].join(" ") + ")",
    [outcome, icon] = isTrue ? ["completed", "✓"] : ["failed", "✗"],
    attributes = { class: "dot outcome o-" + outcome, role: "img", "aria-label": String(isTrue) };
  return el(
    "ul.formula",
    el.li(
      { class: isTrue ? null : "is-false" },
      el.i(attributes, icon),
      el.code(text),
      child.map(conditionTree),
    ),
  );
}

export class Detail {
  /** @param host see timeline/host.js @param requestRedraw called when the details have to be drawn again */
  constructor(host, requestRedraw) {
    this.host = host;
    this.requestRedraw = requestRedraw;
    this.box = el("aside.tl-detail", { "aria-label": "Details", tabindex: 0 });
    this.story = new Story(host);
    this.signature = ""; // identifies the drawn content
    // the numbers of changes of the goal and its actions, at the last request for plans
    this.changeCounts = "";
    this.target = ""; // identifies the drawn item and moment
    this.drawnAt = -Infinity;
    this.timer = null;
    this.plans = null; // {key, list}: plans of a goal in the API's form; the executive's have preconditions
    this.why = null; // the answer to why of an item: {key, node}
    this.readPlans = throttled(() => this.askPlans(), PLANS_MS);
  }
  get history() {
    return this.host.history;
  }

  /** Draw the details of a path (see timeline/host.js), unless the same content is drawn already. */
  draw(path) {
    const { host, history, box } = this,
      { item, goal } = resolve(path, history),
      isStory = !path.goal && !path.skill,
      isRunning = host.isLive && item && outcomeAt(item) === "running";
    box.classList.toggle("is-story", isStory);
    const changeCounts = goal
      ? [goal, ...goal.actions].map(({ key, changes }) => key + changes.length).join()
      : "";
    if (goal && changeCounts !== this.changeCounts) {
      this.changeCounts = changeCounts;
      this.plannedGoal = goal;
      this.readPlans();
    }
    const target = JSON.stringify([path, this.why?.key, this.plans, host.cursor()?.step]),
      // the duration of a running item is drawn anew each second
      second = isRunning ? Math.floor(host.now().time / 1e6) : 0,
      signature = JSON.stringify(isStory ? this.story.sign() : [target, history.revision, second]);
    if (signature === this.signature || (target === this.target && this.postpone())) return;
    this.target = target;
    this.drawnAt = performance.now();
    this.signature = signature;
    const focused = box.contains(document.activeElement) && document.activeElement.getAttribute("href"),
      missing = () =>
        none((path.goal || "The call") + " does not exist", "It may not have begun, or it is forgotten.");
    if (isStory) refill(box, this.story.draw(this.requestRedraw));
    else refill(box, this.crumbs(path), item ? this[item.kind](item) : missing());
    // the refill has removed the focused link: the new link to the same address gets the focus
    if (focused) [...box.querySelectorAll("a")].find((a) => a.getAttribute("href") === focused)?.focus();
  }

  /**
   * Postpone the drawing after a recent one: the details of an item change at most twice a second, so that
   * they can be read. Returns whether the drawing was postponed.
   */
  postpone() {
    const remainingMs = this.drawnAt + MIN_REDRAW_MS - performance.now();
    if (remainingMs <= 0) return false;
    this.timer ??= setTimeout(() => {
      this.timer = null;
      this.requestRedraw();
    }, remainingMs);
    return true;
  }

  /** The path from the run to the shown item, as links. */
  crumbs(path) {
    const { goal, action, call } = resolve(path, this.history),
      entries = [
        ["The run", {}],
        goal && [goal.id, { goal: path.goal }],
        action && [action.id + " " + action.text, { goal: path.goal, action: path.action }],
        call && [call.text, path],
      ].filter(Boolean);
    const crumb = ([text, to], at) =>
      el.li(
        at && at === entries.length - 1
          ? el.b({ "aria-current": "page" }, text)
          : link(this.host.href(to), text),
      );
    const close = { href: this.host.href({}), "aria-label": "close", title: "close" };
    return el(
      "nav.tl-crumbs",
      { "aria-label": "Breadcrumb" },
      el.ol(entries.map(crumb)),
      el("a.tl-close", close, "✕"),
    );
  }

  /** A button with the time of a point, which moves the cursor to the point. */
  timeButton(point) {
    const attributes = { class: "tl-time", title: "go to this moment" };
    return button(clockText(point.time, 3), () => this.host.setCursor(point), attributes);
  }
  /** The step of the chosen moment. */
  get step() {
    return this.host.cursor()?.step ?? Infinity;
  }
  /** The title, and the outcome at the chosen moment; for an open goal its mode. */
  head(title, item) {
    const { step } = this,
      outcome = outcomeAt(item, step),
      mode = item.kind === "goal" && lastUpTo(item.changes, step)?.mode,
      waits = mode && step >= this.history.steps && isBlocked(item, this.history),
      // undefined: the usual word
      text = mode && isOpen(outcome) ? mode + (waits ? ", waits" : "") : undefined;
    return el(
      "div.detail-head",
      el.h2(title),
      outcome ? outcomeBadge(waits ? "formulated" : outcome, text) : dim("not begun"),
    );
  }
  /** Pairs of name and value about the times of an item, up to the chosen moment. */
  times(item) {
    const { begin, start, end: last, waited, ran } = timesOf(item, this.history),
      end = last && last.step <= this.step ? last : null,
      began = start && start.step <= this.step ? start : begin,
      moment = this.host.cursor() || this.host.now(),
      soFar = () => durationText(Math.max(0, moment.time - start.time)) + " so far";
    return [
      ["waited", waited ? durationText(waited) : ""],
      ["began", item.kind === "action" && !start ? "never started" : this.timeButton(began)],
      ["ran", end && ran !== null ? durationText(ran) : start && !end ? soFar() : ""],
      ["ended", end ? this.timeButton(end) : ""],
    ];
  }
  list(title, items, entry, className = null) {
    return listSection(title, items, entry, { most: MAX_ENTRIES, className });
  }
  link(item, text) {
    return link(this.host.href(pathTo(item)), text);
  }
  outcomeLink(item, text) {
    return [outcomeBadge(outcomeAt(item, this.step) || "formulated"), " ", this.link(item, text)];
  }
  /** @param badge(change) the element that shows a change */
  changes({ changes }, badge) {
    const entry = (change) =>
      el.li({ class: change.step > this.step ? "later" : null }, this.timeButton(change), " ", badge(change));
    return el(
      "details.tl-steps",
      { open: changes.length < FOLD_FROM_CHANGES },
      el.summary("Changes"),
      el("ul.tl-list", changes.map(entry)),
    );
  }

  goal(goal) {
    const { goals, gone } = this.host.app.model,
      known = goals.get(goal.key) || gone.get(goal.key),
      slots = { ...(known?.event && slotsIn(known.event)), ...known?.details },
      parent = this.history.goals.get(goal.parent),
      robots = new Set(goal.actions.flatMap(({ calls }) => calls.map(({ skiller }) => skiller))),
      otherSlots = Object.entries(slots).filter(([name]) => !OMITTED_SLOTS.has(name)),
      children = forestOf(this.history).children.get(goal.key) || [];
    return [
      this.head(goal.id, goal),
      errorBox(errorOf(goal)),
      this.reasons(goal),
      pairs([
        ["class", goal.cls === goal.id ? "" : goal.cls],
        ["type", slots.type],
        ["sub-type", goal.subType],
        ["parent", parent ? this.link(parent, parent.id) : ""],
        ...this.times(goal),
        ["robot", [...robots].join(", ")],
        ["priority", nonDefaultText(slots.priority)],
        ...["parameters", "meta", "message"].map((name) => [name, words(slots[name])]),
        ...["required", "acquired"].map((name) => [name, words(slots[name + "-resources"])]),
        ...otherSlots.map(([name, value]) => [name, nonDefaultText(value)]),
        ["environment", goal.env === MAIN_ENV ? "" : goal.env],
      ]),
      this.plan(goal),
      this.list("Sub-goals", children, (child) => this.outcomeLink(child, child.id)),
      this.log(goal),
      this.changes(goal, (change) => outcomeBadge(goalOutcome(change), goalText(change))),
    ];
  }
  /** The actions of the plans, including actions of the API's plans that have no event yet. */
  plan(goal) {
    const plans = this.plans?.key === goal.key ? this.plans.list : [],
      idOf = (plan, id) => plan + " " + id,
      planned = plans.flatMap(({ id, actions }) => actions.map((action) => [idOf(id, action.id), action])),
      byId = new Map(planned),
      rows = goal.actions.map((action) => ({ action, model: byId.get(idOf(action.plan, action.id)) }));
    for (const { plan, id } of goal.actions) byId.delete(idOf(plan, id));
    const future = [...byId.values()].map((model) => ({ action: null, model }));
    return this.list("Plan", [...rows, ...future], (row) => this.planned(row), "action");
  }
  /** A row of the plan. @param row an action in the events, and its model of the API; one may be missing */
  planned({ action, model }) {
    const state = action ? (lastUpTo(action.changes, this.step)?.state ?? "FORMULATED") : model.state,
      outcome = actionOutcome(state),
      robot = action?.calls.at(-1)?.skiller,
      condition = outcome === "formulated" && model?.preconditions;
    return [
      outcomeBadge(outcome, state),
      " ",
      action
        ? this.link(action, action.id + " " + action.text)
        : [model.id, model["operator-name"], ...model["param-values"]].join(" "),
      robot && dim(" " + robot),
      condition &&
        !condition["is-satisfied"] &&
        el("details.lacks", el.summary("precondition is false"), conditionTree(condition)),
    ];
  }
  action(action) {
    const { calls } = action,
      title = calls.some((call) => call.guessed) ? "Probably its skill calls" : "Skill calls",
      entry = (call) => this.outcomeLink(call, call.skiller + ": " + call.text);
    return [
      this.head("Action " + action.id + " " + action.text, action),
      this.reasons(action),
      pairs([["plan", action.plan], ...this.times(action)]),
      this.list(title, calls, entry) ||
        note(
          timesOf(action, this.history).start
            ? "The action has no known skill call."
            : "The action never started.",
        ),
      this.log(action),
      this.changes(action, ({ state }) => outcomeBadge(actionOutcome(state), state)),
    ];
  }
  skill(call) {
    const { action } = call;
    return [
      this.head("Skill call", call),
      el.p(el.code(call.text)),
      errorBox(call.error),
      pairs([
        ["robot", call.skiller],
        [call.guessed ? "probably of" : "of", action ? this.link(action, action.text) : ""],
        ...this.times(call),
        ["status", call.status],
      ]),
      this.log(call),
    ];
  }

  /**
   * The causes from the events, and a button for the answer of `cxbridge why`, which replaces both; null
   * without causes and button.
   */
  reasons(item) {
    const mayAsk = canAsk(this.host.app, item.env),
      answerNode = this.why?.key === item.key ? this.why.node : null,
      hasChain = outcomeAt(item) !== "completed" && causes(item, this.history).length > 1,
      attributes = { id: "why", title: "the answer of cxbridge why" };
    if (!hasChain && !mayAsk) return null;
    return el(
      "section#why-text.story-why",
      el.h3("Why"),
      answerNode || (hasChain && chain(this.host, item, this.history)),
      mayAsk && !answerNode && button("Why?", () => this.askWhy(item), attributes),
    );
  }
  askWhy({ kind, key, id, env, goal }) {
    // the key of a goal begins with its environment, unless that is the executive's
    const goalId = goal?.slice(goal.startsWith(env + ":") ? env.length + 1 : 0),
      name = kind === "action" ? goalId + "/" + id : id;
    const show = (node) => {
      this.why = { key, node };
      this.signature = this.target = "";
      this.requestRedraw();
    };
    return showAnswer(this.host.app, [kind, name, env], show);
  }
  /**
   * Read the plans of the goal that was drawn last. If its environment is not the executive's, the plans come
   * from facts.
   */
  async askPlans() {
    const { plannedGoal: goal, host } = this,
      { app } = host,
      known = goal && !app.recording && app.model.goals.get(goal.key);
    if (!known) return;
    let list;
    if (goal.env !== MAIN_ENV)
      list = (await readModels(goal.env, "plans")).filter((plan) => plan["goal-id"] === known.name);
    else {
      known.details = await get("clips-executive/goals/" + escapePart(known.name));
      const path = "clips-executive/plans/" + escapePart(known.name) + "/";
      list = await Promise.all((known.details.plans || []).map((plan) => get(path + escapePart(plan))));
    }
    this.plans = { key: goal.key, list };
    this.requestRedraw();
  }

  /** Warnings and errors of the log during an item, up to the moment, except lines about other robots. */
  log(item) {
    const { begin, end } = timesOf(item, this.history),
      isOver = end && end.step <= this.step,
      last = isOver ? { time: end.time + LATE_US } : this.host.cursor() || this.host.now(),
      isBad = ({ level }) => level === "W" || level === "E",
      lines = this.host
        .lines(begin, last)
        .filter(isBad)
        .filter(lineFilter(item, this.history, begin.time, last.time)),
      more = lines.length - MAX_LOG_LINES;
    if (!lines.length) return null;
    const entry = (line) =>
      el.li(
        ...[this.timeButton(line), " ", el.b({ class: "lv lv-" + line.level }, line.level), " "],
        ...[dim(line.component + ": "), line.text],
      );
    return el.section(
      el.h3("Warnings and errors meanwhile"),
      el("ol.tl-log", lines.slice(-MAX_LOG_LINES).map(entry)),
      el.p(
        link("#/log?time=" + (end || begin).time, "All lines"),
        more > 0 && dim(", " + more + " more warnings and errors"),
      ),
    );
  }
  close() {
    clearTimeout(this.timer);
    this.readPlans.stop();
  }
}
