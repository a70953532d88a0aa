// The plans of a goal: actions with their states, and what a waiting one still lacks.
import { el } from "cx/dom.js";
import { formulaTree, ofApi } from "cx/domain/formula.js";
import { actionOutcome, OUTCOMES, outcomeBadge } from "cx/outcome.js";

const WAITING = ["FORMULATED", "PENDING"];

function actionRow(action, isChosen) {
  const outcome = actionOutcome(action.state),
    isWaiting = WAITING.includes(action.state);
  const lacks = isWaiting && action.preconditions ? ofApi(action.preconditions) : null;
  return el(
    "li",
    { class: "action" + (isChosen ? " selected" : ""), id: "action-" + action.id },
    el("i", { class: "dot outcome o-" + outcome, "aria-hidden": "true" }, OUTCOMES[outcome].icon),
    el("span", { class: "dim num" }, String(action.id)),
    el(
      "code",
      { class: "main-text" },
      el("b", {}, action.name),
      action.values.length ? " " + action.values.join(" ") : "",
    ),
    action.robot ? el("span", { class: "dim small" }, action.robot) : null,
    isWaiting && action.executable ? el("span", { class: "dim small" }, "executable") : null,
    outcomeBadge(outcome, action.state),
    lacks && !lacks.satisfied
      ? el("details", { class: "lacks" }, el("summary", {}, "precondition is false"), formulaTree(lacks))
      : null,
  );
}

/** @param chosen id of the action that is marked */
export function drawPlan(plan, chosen) {
  const done = plan.actions.filter((action) => action.state === "FINAL").length;
  return el(
    "div",
    { class: "plan" },
    el(
      "h3",
      {},
      "Plan ",
      el("code", {}, plan.id),
      el(
        "span",
        { class: "dim" },
        "  " + done + " of " + plan.actions.length + " done" + (plan.cost > 0 ? ", cost " + plan.cost : ""),
      ),
    ),
    plan.actions.length
      ? el(
          "ol",
          { class: "actions" },
          plan.actions.map((action) => actionRow(action, String(action.id) === chosen)),
        )
      : el("p", { class: "dim" }, "without actions"),
  );
}
