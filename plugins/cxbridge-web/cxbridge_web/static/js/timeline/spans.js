// Bars: the spans of a goal, a plan-action or a skill call, with their outcomes.
import { actionOutcome, goalOutcome, skillOutcome } from "cx/outcome.js";
import { lastUpTo } from "cx/timeline/history.js";

/**
 * @typedef {object} Span
 * @property {{time: number, step: number}} from
 * @property {{time: number, step: number} | null} to null: an open span
 * @property {string} outcome see outcome.js
 * @property {"wait" | "run" | "tail"} part before, during and after the run
 */

// the part of a span by mode or state; "gone" and "none" have no span
const GOAL_PARTS = { RETRACTED: "gone", FINISHED: "tail", EVALUATED: "tail", DISPATCHED: "run" },
  ACTION_PARTS = { FORMULATED: "none", PENDING: "wait", WAITING: "wait", FINAL: "tail", FAILED: "tail" };
const goalPart = ({ mode }) => GOAL_PARTS[mode] || "wait",
  actionPart = ({ state }) => ACTION_PARTS[state] || "run";

/**
 * Join successive changes of the same part: {part, changes}. A dispatched goal runs until it is finished,
 * whatever its modes between sub-goals are; it waits again when it is formulated again.
 */
function joined(changes, partOf) {
  const parts = [];
  for (const change of changes) {
    const last = parts.at(-1),
      isAgain = change.mode === "FORMULATED" && last !== undefined,
      changePart = partOf(change),
      part = last?.part === "run" && changePart === "wait" && !isAgain ? "run" : changePart;
    if (last?.part === part && !isAgain) last.changes.push(change);
    else parts.push({ part, changes: [change] });
  }
  return parts;
}

function goalSpans(goal) {
  return joined(goal.changes, goalPart).flatMap(({ part, changes }, at, parts) => {
    const next = parts[at + 1],
      from = changes[0],
      to = next ? next.changes[0] : null,
      isOver = next && (next.part === "tail" || next.part === "gone"),
      endOutcome = isOver ? goalOutcome(next.changes.at(-1)) : null;
    if (part === "gone") return [];
    if (part === "tail") return { from, to, part, outcome: goalOutcome(changes.at(-1)) };
    if (part === "run") return { from, to, part, outcome: endOutcome || (next ? "retracted" : "running") };
    if (next?.part !== "tail")
      return { from, to, part, outcome: next?.part === "gone" ? endOutcome : "formulated" };
    // a goal that was never dispatched runs from its selection to its outcome
    const began = changes[1] || to,
      wait = began === from ? [] : [{ from, to: began, part, outcome: "formulated" }];
    return [...wait, { from: began, to, part: "run", outcome: endOutcome }];
  });
}

/** @param gone the change by which the goal was retracted; null: the goal was not retracted */
function actionSpans(action, gone) {
  const spans = [],
    parts = joined(action.changes, actionPart);
  for (const [at, { part, changes }] of parts.entries()) {
    const next = parts[at + 1],
      from = changes[0],
      last = changes.at(-1);
    // an action that ended without a start has a span of no length
    if (part === "tail" && !spans.length)
      spans.push({ from, to: from, part: "run", outcome: actionOutcome(from.state) });
    if (part === "none" || part === "tail") continue;
    const endOutcome = next?.part === "tail" ? actionOutcome(next.changes.at(-1).state) : null,
      hasFailed = !next && actionOutcome(last.state) === "failed",
      isAbandoned = !next && !hasFailed && gone && gone.step > last.step,
      to = next ? next.changes[0] : hasFailed ? last : isAbandoned ? gone : null,
      openOutcome =
        part === "wait" ? "formulated" : hasFailed ? "failed" : isAbandoned ? "retracted" : "running";
    spans.push({ from, to, part, outcome: endOutcome || openOutcome });
  }
  return spans;
}

const spanCache = new WeakMap(); // item -> its spans, and the sign of their state
const plannerOutcome = ({ end, status }) => (!end ? "running" : status === "found" ? "completed" : "failed");

/** The spans of a goal, an action, a skill call or a planner's call. @returns {Span[]} in order */
export function spansOf(item, history) {
  if (item.kind === "skill" || item.kind === "planner") {
    const outcome = item.kind === "skill" ? skillOutcome(item.status) : plannerOutcome(item);
    return [{ from: item.begin, to: item.end, part: "run", outcome }];
  }
  const isAction = item.kind === "action",
    goal = isAction ? history.goals.get(item.goal) : item,
    sign = [item.changes.length, item.changes.at(-1).step, goal?.changes.length].join(),
    cached = spanCache.get(item);
  if (cached && cached.sign === sign) return cached.spans;
  const [first] = item.changes,
    isGone = ({ mode, step }) => mode === "RETRACTED" && step > first.step,
    spans = isAction ? actionSpans(item, goal?.changes.find(isGone) || null) : goalSpans(item);
  spanCache.set(item, { sign, spans });
  return spans;
}

/**
 * The runs of actions within a span of their goal, in lanes without overlaps.
 * @returns {{item: object, span: Span, lane: number, lanes: number}[]} in the order of their beginnings
 */
export function stacked(actions, goalSpan, history) {
  const laneEnds = [], // the last step in each lane
    isWithin = ({ step }) => step >= goalSpan.from.step && (!goalSpan.to || step <= goalSpan.to.step),
    runs = actions
      .flatMap((item) => spansOf(item, history).map((span) => ({ item, span })))
      .filter(({ span }) => span.part === "run" && isWithin(span.from))
      .sort((a, b) => a.span.from.step - b.span.from.step);
  for (const run of runs) {
    const freeLane = laneEnds.findIndex((end) => end <= run.span.from.step);
    run.lane = freeLane < 0 ? laneEnds.length : freeLane;
    laneEnds[run.lane] = run.span.to ? run.span.to.step : Infinity;
  }
  return runs.map((run) => ({ ...run, lanes: laneEnds.length }));
}

/** The outcome of an item at a step; null before the item began. */
export function outcomeAt(item, step = Infinity) {
  if (item.kind === "skill") {
    if (item.begin.step > step) return null;
    return item.end && item.end.step <= step ? skillOutcome(item.status) : "running";
  }
  const change = lastUpTo(item.changes, step);
  if (!change) return null;
  return item.kind === "goal" ? goalOutcome(change) : actionOutcome(change.state);
}

/**
 * The moments of an item and its durations: {begin, start (of its first run), end, waited, ran}, durations in
 * microseconds; null for a change that has not happened yet.
 */
export function timesOf(item, history) {
  const runs = spansOf(item, history).filter(({ part }) => part === "run"),
    begin = item.begin || item.changes[0],
    start = runs[0]?.from ?? null,
    end = runs.at(-1)?.to ?? null;
  return {
    begin,
    start,
    end,
    waited: start ? start.time - begin.time : null,
    ran: end ? end.time - start.time : null,
  };
}
