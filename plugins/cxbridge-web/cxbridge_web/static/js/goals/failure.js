// The way from a goal that failed to the first cause: the sub-goal, the action and the skill that failed.
import { actionOutcome, goalOutcome } from "cx/outcome.js";

const isBad = (goal) => ["failed", "rejected"].includes(goalOutcome(goal));
const endOf = (goal) => {
  const step = goal.history.find((each) => each.outcome === "FAILED" || each.outcome === "REJECTED");
  return step ? step.time : 0;
};

/**
 * @param children Map goal's key -> goals
 * @returns steps {kind: goal|action|skill, ...}, the last one is the first cause
 */
export function wayToFailure(model, goal, children) {
  const way = [],
    seen = new Set();
  let at = goal;
  while (at && !seen.has(at.key)) {
    seen.add(at.key);
    way.push({ kind: "goal", goal: at });
    const end = endOf(at) || Infinity;
    const bad = (children.get(at.key) || []).filter((each) => isBad(each) && endOf(each) <= end);
    bad.sort((a, b) => endOf(a) - endOf(b));
    if (!bad.length) break;
    at = bad.at(-1);
  }
  const last = way.at(-1).goal,
    actions = [...(model.actions.get(last.key) || new Map()).values()];
  const action = actions.find((each) => actionOutcome(each.state) === "failed" || each.hasFailed);
  if (!action) return way;
  way.push({ kind: "action", goal: last, action });
  const { call } = action;
  if (call) way.push({ kind: "skill", goal: last, action, call });
  return way;
}

/** Goals that failed: roots first; then those that failed although what they were for did not. */
export function failures(goals, parents) {
  const bad = goals.filter(isBad),
    keys = new Set(bad.map((goal) => goal.key));
  const tops = bad.filter((goal) => !keys.has(parents.get(goal.key)));
  return {
    roots: tops.filter((goal) => !parents.get(goal.key)),
    overcome: tops.filter((goal) => parents.get(goal.key)),
  };
}
