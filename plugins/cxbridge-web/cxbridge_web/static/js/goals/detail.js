// One goal: what it is, why it is so, its plans and sub-goals, and how it came here.
import { part } from "cx/api.js";
import { button, clockText, durationText, el, pairs } from "cx/dom.js";
import { goalText } from "cx/looks.js";
import { MAIN_ENV } from "cx/model.js";
import { goalOutcome, outcomeBadge } from "cx/outcome.js";
import { durationOf, robotsOf } from "cx/goals/numbers.js";
import { drawPlan } from "cx/goals/plan.js";

// what is shown by other names, in other places, or not at all
const SHOWN = new Set(
  "kind apiVersion id class type sub-type parent mode outcome error plans priority parameters meta message".split(
    " ",
  ),
)
  .add("required-resources")
  .add("acquired-resources");

// values that slots have while no rule has given them another
const USUAL = new Set(["", "0", "nil", "FALSE", "DEFAULT"]);

const link = (key, text = key) => el("a", { href: "#/goals/" + part(key) }, text);

/** The plans: as the API has them, their states as the last events had them; else made of events. */
function planList(goal, plans, states) {
  const stateOf = (plan, action) => states.get(plan + " " + action) || {};
  if (plans)
    return plans.map((plan) => ({
      id: plan.id,
      cost: plan.cost,
      actions: plan.actions.map((action) => ({
        id: action.id,
        name: action["operator-name"],
        values: action["param-values"],
        executable: action.executable,
        preconditions: action.preconditions,
        state: stateOf(plan.id, action.id).state || action.state,
        robot: stateOf(plan.id, action.id).skiller || "",
      })),
    }));
  const byPlan = new Map();
  for (const action of states.values()) {
    if (!byPlan.has(action.plan)) byPlan.set(action.plan, []);
    byPlan.get(action.plan).push({ ...action, robot: action.skiller });
  }
  for (const actions of byPlan.values()) actions.sort((a, b) => Number(a.id) - Number(b.id));
  return [...byPlan].map(([id, actions]) => ({ id, actions }));
}

function history(goal) {
  if (!goal.history.length) return null;
  const first = goal.history[0].time;
  return el(
    "section",
    {},
    el("h3", {}, "How it came here"),
    el(
      "ol",
      { class: "history" },
      goal.history.map((step, at) =>
        el(
          "li",
          {},
          el("span", { class: "dim n" }, at ? "+" + durationText(step.time - first) : clockText(step.time)),
          " ",
          outcomeBadge(goalOutcome(step), goalText(step)),
          step.error ? el("span", { class: "bad-text" }, " " + step.error) : null,
        ),
      ),
    ),
  );
}

function subGoals(children) {
  if (!children.length) return null;
  return el(
    "section",
    {},
    el("h3", {}, "Sub-goals"),
    el(
      "ol",
      { class: "history" },
      children.map((each) =>
        el(
          "li",
          {},
          outcomeBadge(goalOutcome(each), goalText(each)),
          " ",
          link(each.key, each.id),
          each.error ? el("span", { class: "bad-text" }, " " + each.error) : null,
        ),
      ),
    ),
  );
}

/**
 * @param shown.plans of the API, null: made of events; shown.why a node or null; shown.askWhy a call or null;
 * shown.children the sub-goals
 */
export function goalDetail(app, goal, { plans, why, askWhy, children }) {
  const details = { ...goal.told, ...goal.details },
    states = app.model.actions.get(goal.key) || new Map(),
    list = planList(goal, plans, states),
    duration = durationOf(goal, app.now),
    words = (values) =>
      Array.isArray(values) ? values.join(" ") : String(values ?? "").replace(/^"(.*)"$/s, "$1"),
    further = Object.entries(details).filter(([name, value]) => !SHOWN.has(name) && !USUAL.has(words(value)));
  return el(
    "div",
    {},
    el(
      "div",
      { class: "detail-head" },
      el("a", { class: "back", href: "#/goals?goal=", "aria-label": "back to the goals" }, "←"),
      el("h2", {}, goal.id),
      outcomeBadge(goalOutcome(goal), goalText(goal)),
      askWhy ? button("Why?", askWhy, { id: "why", title: "how it came to this" }) : null,
      el("a", { href: "#/goals?goal=", class: "to-run" }, "the run"),
    ),
    goal.error ? el("p", { class: "error-box" }, goal.error) : null,
    el(
      "div",
      { class: "columns" },
      el(
        "div",
        {},
        pairs([
          ["class", goal.cls],
          ["type", details.type],
          ["sub-type", goal.subType],
          ["parent", goal.parent ? link(goal.parent) : ""],
          [duration ? duration.verb : "", duration ? durationText(duration.us) : ""],
          ["robot", [...robotsOf(states)].join(", ")],
          ["priority", details.priority === undefined ? "" : String(details.priority)],
          ["parameters", words(details.parameters)],
          ["meta", words(details.meta)],
          ["message", words(details.message)],
          ["required", words(details["required-resources"])],
          ["acquired", words(details["acquired-resources"])],
          ...further.map(([name, value]) => [name, words(value)]),
          ["environment", goal.env === MAIN_ENV ? "" : goal.env],
        ]),
        why ? el("section", { id: "why-text" }, el("h3", {}, "Why"), why) : null,
        list.length
          ? list.map((plan) => drawPlan(plan, app.selection.value.action))
          : children.length
            ? null
            : el("p", { class: "dim" }, "No plan."),
      ),
      el("div", {}, subGoals(children), history(goal)),
    ),
  );
}
