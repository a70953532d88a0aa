// What a goal's row says besides its name: how long it took, how far it is, which robots work for it.
import { goalOutcome, hasEnded, isOpen } from "cx/outcome.js";

/**
 * How long a goal has run, or waited if it has not been dispatched; microseconds.
 * @param now the moment that is looked at
 * @returns {us, waits: a word, if it was not dispatched}; null: its begin is not known
 */
export function durationOf({ history, mode }, now) {
  if (!history.length) return null;
  const run = history.find((step) => step.mode === "DISPATCHED"),
    end = history[history.findLastIndex((step) => !hasEnded(step.mode)) + 1], // a goal may be tried again
    begin = run || history[0];
  if (hasEnded(mode) && !end) return null;
  const us = Math.max(0, (end ? end.time : now) - begin.time);
  return { us, waits: run ? "" : end ? "waited" : "waits" };
}

/** Children or, without any, actions of the plan, as "done/all"; "" without both. */
export function progressOf(children, actions) {
  const all = children?.length ? children : [...(actions?.values() ?? [])],
    isDone = (each) => (each.state ? each.state === "FINAL" : !isOpen(goalOutcome(each)));
  return all.length ? all.filter(isDone).length + "/" + all.length : "";
}

/** The robots (Skillers) that the actions of a goal were executed by. */
export const robotsOf = (actions) =>
  new Set([...(actions?.values() ?? [])].map(({ skiller }) => skiller).filter(Boolean));
