// Bars: the stretches of a goal's, a plan-action's or a skill call's life, with their outcomes.
import { actionOutcome, goalOutcome, skillOutcome } from "cx/outcome.js";
import { lastUpTo } from "cx/timeline/history.js";

/**
 * @typedef {object} Span
 * @property {{time: number, step: number}} from
 * @property {{time: number, step: number} | null} to null: it goes on
 * @property {string} outcome see outcome.js
 * @property {"wait" | "run" | "tail"} part waiting to run; running; over, but still there
 */

const OVER = new Set(["FINISHED", "EVALUATED"]);
const goalPart = ({ mode }) =>
  mode === "RETRACTED" ? "gone" : OVER.has(mode) ? "tail" : mode === "DISPATCHED" ? "run" : "wait";

/**
 * Changes joined while they mean the same part. A goal that was dispatched runs until it is finished: between its
 * sub-goals it may be in other modes. Only when it is formulated again it waits again.
 */
function joined(changes, partOf) {
  const parts = [];
  for (const change of changes) {
    const last = parts.at(-1),
      isAgain = change.mode === "FORMULATED" && last !== undefined;
    let part = partOf(change);
    if (last && last.part === "run" && part === "wait" && !isAgain) part = "run";
    if (last && last.part === part && !isAgain) last.changes.push(change);
    else parts.push({ part, changes: [change] });
  }
  return parts;
}

function goalSpans(goal) {
  const spans = [],
    parts = joined(goal.changes, goalPart);
  for (const [at, { part, changes }] of parts.entries()) {
    const next = parts[at + 1],
      from = changes[0],
      to = next ? next.changes[0] : null;
    if (part === "gone") continue;
    if (part === "tail") {
      spans.push({ from, to, part, outcome: goalOutcome(changes.at(-1)) });
      continue;
    }
    const end = next && next.part !== "wait" && next.part !== "run" ? next.changes.at(-1) : null,
      ended = end ? goalOutcome(end) : null;
    if (part === "run") spans.push({ from, to, part, outcome: ended || (next ? "retracted" : "running") });
    else if (ended && next.part === "tail") {
      // never dispatched: from when it was selected, if ever, it ran into its outcome
      const began = changes[1] || to;
      if (began !== from) spans.push({ from, to: began, part, outcome: "formulated" });
      spans.push({ from: began, to, part: "run", outcome: ended });
    } else spans.push({ from, to, part, outcome: next && next.part === "gone" ? ended : "formulated" });
  }
  return spans;
}

const actionPart = ({ state }) =>
  state === "FORMULATED"
    ? "none"
    : state === "PENDING" || state === "WAITING"
      ? "wait"
      : /^(FINAL|FAILED)$/.test(state)
        ? "tail"
        : "run";

/** @param gone when its goal was retracted, null: it is there */
function actionSpans(action, gone) {
  const spans = [],
    parts = joined(action.changes, actionPart);
  for (const [at, { part, changes }] of parts.entries()) {
    if (part === "none") continue;
    const next = parts[at + 1];
    if (part === "tail") {
      if (!spans.length)
        spans.push({
          from: changes[0],
          to: changes[0],
          part: "run",
          outcome: actionOutcome(changes[0].state),
        });
      continue;
    }
    const last = changes.at(-1),
      ended = next && next.part === "tail" ? actionOutcome(next.changes.at(-1).state) : null,
      isOver = !next && actionOutcome(last.state) === "failed";
    const to = next ? next.changes[0] : isOver ? last : gone && gone.step > last.step ? gone : null;
    const outcome =
      part === "wait" && !(ended && next.part === "tail")
        ? "formulated"
        : ended || (isOver ? "failed" : to && !next ? "retracted" : "running");
    spans.push({ from: changes[0], to, part, outcome });
  }
  return spans;
}

const known = new WeakMap(); // item -> its spans, and of which state they are

/** @returns {Span[]} in order */
export function spansOf(item, history) {
  if (item.kind === "skill" || item.kind === "planner") {
    const outcome =
      item.kind === "skill"
        ? skillOutcome(item.status)
        : item.end
          ? item.status === "found"
            ? "completed"
            : "failed"
          : "running";
    return [{ from: item.begin, to: item.end, part: "run", outcome }];
  }
  const goal = item.kind === "action" ? history.goals.get(item.goal) : item;
  const sign = item.changes.length + " " + item.changes.at(-1).step + " " + (goal ? goal.changes.length : 0);
  const before = known.get(item);
  if (before && before.sign === sign) return before.spans;
  const first = item.changes[0].step,
    gone =
      goal && item.kind === "action"
        ? goal.changes.find(({ mode, step }) => mode === "RETRACTED" && step > first) || null
        : null;
  const spans = item.kind === "action" ? actionSpans(item, gone) : goalSpans(item);
  known.set(item, { sign, spans });
  return spans;
}

/**
 * The runs of a goal's actions within a span of the goal: in lanes, so that none covers another.
 * @returns {{item: object, span: Span, lane: number, lanes: number}[]} in the order of their beginnings
 */
export function stacked(actions, whole, history) {
  const found = [],
    ends = []; // of each lane
  for (const item of actions)
    for (const span of spansOf(item, history)) {
      const isWithin = span.from.step >= whole.from.step && (!whole.to || span.from.step <= whole.to.step);
      if (span.part === "run" && isWithin) found.push({ item, span, lane: 0, lanes: 1 });
    }
  found.sort((a, b) => a.span.from.step - b.span.from.step);
  for (const each of found) {
    const free = ends.findIndex((end) => end <= each.span.from.step);
    each.lane = free < 0 ? ends.length : free;
    ends[each.lane] = each.span.to ? each.span.to.step : Infinity;
  }
  for (const each of found) each.lanes = ends.length;
  return found;
}

/** What became of it up to a step, as far as known then; null: it was not there yet. */
export function outcomeAt(item, step = Infinity) {
  if (item.kind === "skill") {
    if (item.begin.step > step) return null;
    return item.end && item.end.step <= step ? skillOutcome(item.status) : "running";
  }
  const change = lastUpTo(item.changes, step);
  if (!change) return null;
  return item.kind === "goal" ? goalOutcome(change) : actionOutcome(change.state);
}

/** When it began and ended, and for how long it ran; null for what has not happened. */
export function timesOf(item, history) {
  const spans = spansOf(item, history),
    runs = spans.filter(({ part }) => part === "run"),
    first = item.begin || item.changes[0],
    lastRun = runs.at(-1);
  return {
    begin: first,
    start: runs.length ? runs[0].from : null,
    end: lastRun ? lastRun.to : null,
    waited: runs.length ? runs[0].from.time - first.time : null,
    ran: lastRun && lastRun.to ? lastRun.to.time - runs[0].from.time : null,
  };
}
