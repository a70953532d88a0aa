// Beside the timeline and the table of goals: the goal, the action or the skill call that is chosen, with its why;
// without one the story of the run.
import { get, part, throttled } from "cx/api.js";
import { button, clockText, durationText, el, none, pairs, refill } from "cx/dom.js";
import { formulaTree, ofApi } from "cx/domain/formula.js";
import { readOf } from "cx/env.js";
import { MAIN_ENV } from "cx/names.js";
import { actionOutcome, goalOutcome, isOpen, outcomeBadge } from "cx/outcome.js";
import { causes, errorOf, forestOf } from "cx/story/causes.js";
import { chain, Story } from "cx/story/story.js";
import { lastUpTo } from "cx/timeline/history.js";
import { pathTo, resolve } from "cx/timeline/path.js";
import { outcomeAt, timesOf } from "cx/timeline/spans.js";
import { answer, canAsk } from "cx/why.js";

const MOST = 200, // entries of a list
  MOST_LINES = 8,
  REST_MS = 500,
  LATE_US = 200_000, // a line about an end comes after it
  PLANS_MS = 1000;
// what is shown by other names, in other places, or not at all
const SHOWN = new Set(
  (
    "kind apiVersion id class type sub-type parent mode outcome error plans priority parameters meta message " +
    "required-resources acquired-resources"
  ).split(" "),
);
// values that slots have while no rule has given them another
const USUAL = new Set(["", "0", "nil", "FALSE", "DEFAULT"]);
const words = (values) =>
  Array.isArray(values) ? values.join(" ") : String(values ?? "").replace(/^"(.*)"$/s, "$1");

export class Detail {
  /**
   * @param host see timeline/host.js
   * @param later called when there is more to draw
   */
  constructor(host, later) {
    this.host = host;
    this.later = later;
    this.box = el("aside.tl-detail", { "aria-label": "Details", tabindex: 0 });
    this.story = new Story(host);
    this.sign = "";
    this.lengths = ""; // of the changes of the goal whose plans were asked for
    this.target = "";
    this.drawnAt = -Infinity;
    this.timer = null;
    this.plans = null; // of the API, with preconditions: {key, list}
    this.why = null; // the answer to why: {key, node}
    this.readPlans = throttled(() => this.askPlans(), PLANS_MS);
  }
  get history() {
    return this.host.history;
  }

  draw(path) {
    const { host, history } = this,
      { item, goal } = resolve(path, history),
      isStory = !path.goal && !path.skill,
      now = host.now(),
      isOn = host.isLive && item && outcomeAt(item) === "running";
    this.box.classList.toggle("is-story", isStory);
    const lengths = goal
      ? [goal, ...goal.actions].map(({ key, changes }) => key + changes.length).join()
      : "";
    if (goal && lengths !== this.lengths) {
      this.lengths = lengths;
      this.readOf = goal;
      this.readPlans();
    }
    const target = JSON.stringify([path, this.why?.key, this.plans, host.cursor()?.step]),
      second = isOn ? Math.floor(now.time / 1e6) : 0,
      sign = JSON.stringify(isStory ? this.story.sign() : [target, history.revision, second]);
    if (sign === this.sign || (target === this.target && this.rests())) return;
    this.target = target;
    this.drawnAt = performance.now();
    this.sign = sign;
    const focused = this.box.contains(document.activeElement)
      ? document.activeElement.getAttribute("href")
      : null;
    if (isStory) refill(this.box, this.story.draw(this.later));
    else
      refill(
        this.box,
        this.crumbs(path),
        ...(item
          ? this.content(item)
          : [none("There is no " + (path.goal || "such call"), "Not yet, or not any more.")]),
      );
    if (focused) [...this.box.querySelectorAll("a")].find((a) => a.getAttribute("href") === focused)?.focus();
  }

  /** Of a busy run the same thing is drawn twice a second: a reader there is not disturbed more often. */
  rests() {
    const rest = this.drawnAt + REST_MS - performance.now();
    if (rest <= 0) return false;
    this.timer ??= setTimeout(() => {
      this.timer = null;
      this.later();
    }, rest);
    return true;
  }

  /** From the run down to the item: each level leads back. */
  crumbs(path) {
    const { goal, action, call } = resolve(path, this.history),
      entries = [["The run", {}]];
    if (goal) entries.push([goal.id, { goal: path.goal }]);
    if (action) entries.push([action.id + " " + action.text, { goal: path.goal, action: path.action }]);
    if (call) entries.push([call.text, path]);
    return el(
      "nav.tl-crumbs",
      { "aria-label": "Breadcrumb" },
      el.ol(
        entries.map(([text, to], at) =>
          el.li(
            at && at === entries.length - 1
              ? el.b({ "aria-current": "page" }, text)
              : el.a({ href: this.host.href(to) }, text),
          ),
        ),
      ),
      el("a.tl-close", { href: this.host.href({}), "aria-label": "close", title: "close" }, "✕"),
    );
  }

  content(item) {
    if (item.kind === "goal") return this.goal(item);
    return item.kind === "action" ? this.action(item) : this.call(item);
  }
  at(point) {
    return button(clockText(point.time, 3), () => this.host.setCursor(point), {
      class: "tl-time",
      title: "go to this moment",
    });
  }
  /** What is beyond has not happened at the chosen moment. */
  get step() {
    return this.host.cursor()?.step ?? Infinity;
  }
  /** The title, and the outcome at the chosen moment; of an open goal the mode. */
  head(title, item) {
    const { step } = this,
      outcome = outcomeAt(item, step),
      mode = item.kind === "goal" && lastUpTo(item.changes, step)?.mode;
    return el(
      "div.detail-head",
      el.h2(title),
      outcome
        ? outcomeBadge(outcome, mode && isOpen(outcome) ? mode : undefined)
        : el("span.dim", "not there yet"),
    );
  }
  times(item) {
    const { begin, start, end: last, waited, ran: whole } = timesOf(item, this.history),
      isOver = last && last.step <= this.step,
      [end, ran] = isOver ? [last, whole] : [null, null],
      moment = this.host.cursor() || this.host.now(),
      soFar = start && !end ? Math.max(0, moment.time - start.time) : null;
    return [
      ["began", this.at(begin)],
      ["waited", waited ? durationText(waited) : ""],
      ["ran", ran !== null ? durationText(ran) : soFar !== null ? durationText(soFar) + " so far" : ""],
      ["ended", end ? this.at(end) : ""],
    ];
  }
  list(title, items, entry, className = null) {
    if (!items.length) return null;
    return el.section(
      el.h3(title),
      el(
        "ul.tl-list",
        items.slice(0, MOST).map((each) => el.li({ class: className }, entry(each))),
      ),
      items.length > MOST ? el("p.dim", "and " + (items.length - MOST) + " more") : null,
    );
  }
  link(item, text) {
    return [
      outcomeBadge(outcomeAt(item, this.step) || "formulated"),
      " ",
      el.a({ href: this.host.href(pathTo(item)) }, text),
    ];
  }
  changes(item, badge) {
    const { step } = this;
    return el(
      "details.tl-steps",
      { open: item.changes.length < 12 },
      el.summary("How it came here"),
      el(
        "ul.tl-list",
        item.changes.map((change) =>
          el.li({ class: change.step > step ? "later" : null }, this.at(change), " ", badge(change)),
        ),
      ),
    );
  }

  goal(goal) {
    const { app } = this.host,
      known = app.model.goals.get(goal.key) || app.model.gone.get(goal.key),
      details = { ...known?.told, ...known?.details },
      further = Object.entries(details).filter(
        ([name, value]) => !SHOWN.has(name) && !USUAL.has(words(value)),
      ),
      parent = this.history.goals.get(goal.parent),
      error = errorOf(goal),
      robots = new Set(goal.actions.flatMap(({ calls }) => calls.map(({ skiller }) => skiller)));
    return [
      this.head(goal.id, goal),
      error ? el("p.error-box", error) : null,
      this.reasons(goal),
      pairs([
        ["class", goal.cls === goal.id ? "" : goal.cls],
        ["type", details.type],
        ["sub-type", goal.subType],
        ["parent", parent ? el.a({ href: this.host.href({ goal: parent.key }) }, parent.id) : ""],
        ...this.times(goal),
        ["robot", [...robots].join(", ")],
        ["priority", USUAL.has(words(details.priority)) ? "" : words(details.priority)],
        ["parameters", words(details.parameters)],
        ["meta", words(details.meta)],
        ["message", words(details.message)],
        ["required", words(details["required-resources"])],
        ["acquired", words(details["acquired-resources"])],
        ...further.map(([name, value]) => [name, words(value)]),
        ["environment", goal.env === MAIN_ENV ? "" : goal.env],
      ]),
      this.plan(goal),
      this.list("Sub-goals", forestOf(this.history).children.get(goal.key) || [], (child) =>
        this.link(child, child.id),
      ),
      this.log(goal),
      this.changes(goal, (change) =>
        outcomeBadge(
          goalOutcome(change),
          change.mode + (change.outcome === "UNKNOWN" ? "" : " " + change.outcome),
        ),
      ),
    ];
  }
  /** The actions of the plans, those of the API that have no event yet among them. */
  plan(goal) {
    const told = this.plans?.key === goal.key ? this.plans.list : [],
      seen = new Set(goal.actions.map(({ plan, id }) => plan + " " + id)),
      rows = goal.actions.map((action) => {
        const plan = told.find(({ id }) => id === action.plan);
        return { action, told: plan?.actions.find(({ id }) => String(id) === action.id) };
      });
    for (const plan of told)
      for (const action of plan.actions)
        if (!seen.has(plan.id + " " + action.id)) rows.push({ action: null, told: action });
    return this.list("Plan", rows, (row) => this.planned(row), "action");
  }
  planned({ action, told }) {
    const state = action ? (lastUpTo(action.changes, this.step)?.state ?? "FORMULATED") : told.state,
      text = action
        ? action.id + " " + action.text
        : [told.id, told["operator-name"], ...told["param-values"]].join(" "),
      robot = action?.calls.at(-1)?.skiller,
      outcome = actionOutcome(state),
      lacks = outcome === "formulated" && told?.preconditions ? ofApi(told.preconditions) : null;
    return [
      outcomeBadge(outcome, state),
      " ",
      action ? el.a({ href: this.host.href(pathTo(action)) }, text) : text,
      robot ? el("span.dim", " " + robot) : null,
      lacks && !lacks.satisfied
        ? el("details.lacks", el.summary("precondition is false"), formulaTree(lacks))
        : null,
    ];
  }
  action(action) {
    const { calls } = action,
      probably = calls.some((call) => call.guessed);
    return [
      this.head("Action " + action.id + " " + action.text, action),
      this.reasons(action),
      pairs([["plan", action.plan], ...this.times(action)]),
      this.list(probably ? "Probably its skill calls" : "Skill calls", calls, (call) =>
        this.link(call, call.skiller + ": " + call.text),
      ) || el("p.dim", "No skill call is known for it."),
      this.log(action),
      this.changes(action, ({ state }) => outcomeBadge(actionOutcome(state), state)),
    ];
  }
  call(call) {
    const { action } = call;
    return [
      this.head("Skill call", call),
      el.p(el.code(call.text)),
      call.error ? el("p.error-box", call.error) : null,
      pairs([
        ["robot", call.skiller],
        [
          call.guessed ? "probably of" : "of",
          action ? el.a({ href: this.host.href(pathTo(action)) }, action.text) : "",
        ],
        ...this.times(call),
        ["status", call.status],
      ]),
      this.log(call),
    ];
  }

  /** Why it is so: as the events tell it, and on demand as `cxbridge why` does. */
  reasons(item) {
    const mayAsk = item.kind !== "skill" && canAsk(this.host.app, item.env),
      told = this.why?.key === item.key ? this.why.node : null,
      way = outcomeAt(item) === "completed" ? [] : causes(item, this.history);
    if (way.length < 2 && !mayAsk) return null;
    return el(
      "section#why-text.story-why",
      el.h3("Why"),
      told || (way.length > 1 ? chain(this.host, item, this.history) : null),
      mayAsk && !told
        ? button("Why?", () => this.askWhy(item), {
            id: "why",
            title: "all that is known, as cxbridge why tells it",
          })
        : null,
    );
  }
  async askWhy({ kind, key, id, env, goal }) {
    const name =
      kind === "action" ? goal.slice(goal.startsWith(env + ":") ? env.length + 1 : 0) + "/" + id : id;
    const show = (node) => {
      this.why = { key, node };
      this.sign = this.target = "";
      this.later();
    };
    await answer(this.host.app, [kind, name, env], show);
  }
  async askPlans() {
    const goal = this.readOf,
      { app } = this.host;
    if (!goal || app.recording || !app.model.goals.has(goal.key)) return;
    const known = app.model.goals.get(goal.key);
    let list;
    if (goal.env !== MAIN_ENV)
      list = (await readOf(goal.env, "plans")).filter((plan) => plan["goal-id"] === known.name);
    else {
      known.details = await get("clips-executive/goals/" + part(known.name));
      list = await Promise.all(
        (known.details.plans || []).map((plan) =>
          get("clips-executive/plans/" + part(known.name) + "/" + part(plan)),
        ),
      );
    }
    this.plans = { key: goal.key, list };
    this.later();
  }

  /** Warnings and errors of the log in the time of an item. */
  log(item) {
    const { begin, end } = timesOf(item, this.history),
      last = end ? { time: end.time + LATE_US } : this.host.now(),
      lines = this.host.lines(begin, last).filter(({ level }) => level === "W" || level === "E");
    if (!lines.length) return null;
    return el.section(
      el.h3("Log in its time"),
      el(
        "ol.tl-log",
        lines
          .slice(-MOST_LINES)
          .map((line) =>
            el.li(
              this.at(line),
              " ",
              el.b({ class: "lv lv-" + line.level }, line.level),
              " ",
              el("span.dim", line.component + ": "),
              line.text,
            ),
          ),
      ),
      el.p(
        el.a({ href: "#/log?time=" + (end || begin).time }, "All lines"),
        lines.length > MOST_LINES
          ? el("span.dim", ", " + (lines.length - MOST_LINES) + " more like these")
          : null,
      ),
    );
  }
  close() {
    clearTimeout(this.timer);
    this.readPlans.stop();
  }
}
