// The numbers in a goal's row: duration, progress, robots.
import { goalOutcome, hasEnded, isOpen } from "cx/outcome.js";
import { ofLastAttempt } from "cx/timeline/history.js";
import { outcomeAt } from "cx/timeline/spans.js";

/**
 * How long a goal has run in microseconds, or waited if it was not dispatched.
 * @param now the shown moment
 * @returns {begin, us, waits: a word for a goal that was not dispatched}; null if the begin is unknown
 */
export function durationOf({ history, mode }, now) {
  const run = history.find((step) => step.mode === "DISPATCHED"),
    end = history[history.findLastIndex((step) => !hasEnded(step.mode)) + 1], // a goal may be tried again
    begin = run || history[0];
  if (!begin || (hasEnded(mode) && !end)) return null;
  return {
    ...{ begin: begin.time, us: Math.max(0, (end ? end.time : now) - begin.time) },
    waits: run ? "" : end ? "waited" : "waits",
  };
}

/** The actions of a goal's attempt up to a step; of several actions with an id, the latest. */
function actionsOf({ history, step }, goal) {
  const known = history.goals.get(goal.key),
    begun = known ? ofLastAttempt(known, known.actions, step) : [];
  return [...new Map(begun.map((action) => [action.plan + " " + action.id, action])).values()];
}

/** The children as "done/all", or the actions of a goal without children; "" without both. */
export function progressOf(model, goal, children = []) {
  const actions = actionsOf(model, goal).map((action) => outcomeAt(action, model.step) === "completed"),
    done = children.length ? children.map((child) => !isOpen(goalOutcome(child))) : actions;
  return done.length ? done.filter(Boolean).length + "/" + done.length : "";
}

/** The robots (Skillers) that executed the actions of a goal. */
export function robotsOf(model, goal) {
  const begun = ({ calls }) => calls.filter(({ begin }) => begin.step <= model.step);
  return new Set(actionsOf(model, goal).flatMap((action) => begun(action).at(-1)?.skiller ?? []));
}
