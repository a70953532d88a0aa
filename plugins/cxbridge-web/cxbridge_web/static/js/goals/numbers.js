// What a goal's row says besides its name: how long it took, how far it is, which robots work for it.
import { goalOutcome, hasEnded, isOpen } from "cx/outcome.js";

/**
 * How long a goal has run, or waited if it has not been dispatched; microseconds.
 * @param now the moment that is looked at
 * @returns {us, waited, verb}; null: its begin is not known
 */
export function durationOf(goal, now) {
  const { history } = goal;
  if (!history.length) return null;
  const run = history.find((step) => step.mode === "DISPATCHED"),
    end = history[history.findLastIndex((step) => !hasEnded(step.mode)) + 1], // a goal may be tried again
    begin = run || history[0];
  if (hasEnded(goal.mode) && !end) return null;
  return {
    us: Math.max(0, (end ? end.time : Math.max(now, begin.time)) - begin.time),
    waited: !run,
    verb: run ? (end ? "ran" : "runs") : end ? "waited" : "waits",
  };
}

/** Children or, without any, actions of the plan: {done, of}; null: it has neither. */
export function progressOf(goal, children, actions) {
  if (children && children.length)
    return { done: children.filter((each) => !isOpen(goalOutcome(each))).length, of: children.length };
  if (!actions || !actions.size) return null;
  let done = 0;
  for (const action of actions.values()) if (action.state === "FINAL") done += 1;
  return { done, of: actions.size };
}

/** The robots (Skillers) that the actions of a goal were executed by. */
export function robotsOf(actions) {
  const robots = new Set();
  if (actions) for (const action of actions.values()) if (action.skiller) robots.add(action.skiller);
  return robots;
}
