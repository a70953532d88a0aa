// The numbers in a goal's row: duration, progress, robots.
import { goalOutcome, hasEnded, isOpen } from "cx/outcome.js";
import { ofLastAttempt } from "cx/timeline/history.js";
import { outcomeAt } from "cx/timeline/spans.js";

/**
 * How long a goal has run over all attempts since its first dispatch, or has waited without a dispatch.
 * @param now the shown moment, in microseconds
 * @returns {begin, us, waits}, times in microseconds; `waits` is a word for a goal that was not dispatched,
 * else ""; null if the begin is unknown
 */
export function durationOf({ history, mode }, now) {
  const dispatched = history.find((step) => step.mode === "DISPATCHED"),
    end = history[history.findLastIndex((step) => !hasEnded(step.mode)) + 1], // a goal may be tried again
    begin = dispatched || history[0];
  if (!begin || (hasEnded(mode) && !end)) return null;
  return {
    ...{ begin: begin.time, us: Math.max(0, (end ? end.time : now) - begin.time) },
    waits: dispatched ? "" : end ? "waited" : "waits",
  };
}

/** The actions of a goal's attempt up to a step; of several actions with an id, the latest. */
function actionsOf({ history, step }, goal) {
  const known = history.goals.get(goal.key),
    actions = known ? ofLastAttempt(known, known.actions, step) : [];
  return [...new Map(actions.map((action) => [action.plan + " " + action.id, action])).values()];
}

/** The ended and all children as "3/4", else the completed and all actions; "" without both. */
export function progressOf(model, goal, children = []) {
  const isActionCompleted = (action) => outcomeAt(action, model.step) === "completed",
    hasChildEnded = (child) => !isOpen(goalOutcome(child)),
    flags = children.length ? children.map(hasChildEnded) : actionsOf(model, goal).map(isActionCompleted);
  return flags.length ? flags.filter(Boolean).length + "/" + flags.length : "";
}

/** The robots (Skillers) of the last attempt of a goal: of each action the robot of its latest skill call. */
export function robotsOf(model, goal) {
  const begun = ({ calls }) => calls.filter(({ begin }) => begin.step <= model.step);
  return new Set(actionsOf(model, goal).flatMap((action) => begun(action).at(-1)?.skiller ?? []));
}
