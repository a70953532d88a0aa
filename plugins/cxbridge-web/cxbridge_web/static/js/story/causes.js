// Causes of failures and waits in the events: from a goal down to its sub-goal, action and skill call. The
// server's `why` also knows rules and facts: js/why.js.
import { forestOfGoals } from "cx/forest.js";
import { skillOf } from "cx/names.js";
import { isOpen, OUTCOMES } from "cx/outcome.js";
import { pathTo } from "cx/timeline/host.js";
import { ofLastAttempt } from "cx/timeline/history.js";
import { outcomeAt, timesOf } from "cx/timeline/spans.js";

const DEEPEST = 50, // causes in a chain, and levels of goals that are searched for open work
  LATE_FACTOR = 2, // a late call lasts longer than this multiple of the longest earlier call
  LATE_US = 5e6; // shorter calls are not late

const forests = new WeakMap(); // history -> its trees, and the shape from which they were made

/** The trees of the goals of a history, see forestOfGoals(); made again when its shape changes. */
export function forestOf(history) {
  const known = forests.get(history),
    { shape } = history;
  if (known && known.shape === shape) return known;
  const forest = { shape, ...forestOfGoals([...history.goals.values()]) };
  forests.set(history, forest);
  return forest;
}

/** An error of the core in words: SUB-GOAL-FAILED gen20 becomes "sub-goal failed: gen20". */
export const inWords = (error) =>
  error.replace(
    /^([A-Z]+(?:-[A-Z]+)+|TIMEOUT)\b ?(.*)$/s,
    (_, code, detail) =>
      code.toLowerCase().replaceAll("-", " ").replace("sub goal", "sub-goal") + (detail ? ": " + detail : ""),
  );
/** The last error of a goal in words; "" without an error. */
export const errorOf = (goal) =>
  inWords((goal.changes.findLast(({ error }) => error) || { error: "" }).error);

/** The step at which an item ended; for an open item, the last step. */
const endOf = (item, history) => (timesOf(item, history).end || history.end).step;

/** Whether an item is an open action or call, or a goal with such an action below. */
const hasOpenWork = (item, history, depth = 0) =>
  isOpen(outcomeAt(item)) &&
  (item.kind !== "goal" ||
    ofLastAttempt(item, item.actions).some((each) => isOpen(outcomeAt(each))) ||
    (depth < DEEPEST &&
      (forestOf(history).children.get(item.key) || []).some((each) =>
        hasOpenWork(each, history, depth + 1),
      )));

/**
 * Choose the most likely cause among the items with an outcome. If the outcome is open, that is the first
 * item with open work, since a goal without a plan may wait for the end of another goal, or else the first
 * item. If the outcome is not open, that is the item that ended last. Undefined without such an item.
 */
function chooseCause(items, outcome, history) {
  const candidates = items.filter((item) => outcomeAt(item) === outcome);
  if (isOpen(outcome)) return candidates.find((item) => hasOpenWork(item, history)) || candidates[0];
  return candidates.sort((a, b) => endOf(a, history) - endOf(b, history)).at(-1);
}

/**
 * The cause of an item's outcome among its parts: calls of an action, actions and sub-goals of a goal; or
 * null.
 */
function causeBelow(item, outcome, history) {
  if (item.kind === "skill" || outcome === "completed") return null;
  if (item.kind === "action") return chooseCause(item.calls, outcome, history) || null;
  const actions = ofLastAttempt(item, item.actions),
    children = ofLastAttempt(item, forestOf(history).children.get(item.key) || []);
  const partOutcomes = { rejected: ["rejected", "failed"], running: ["running", "formulated"] }[outcome] || [
    outcome,
  ];
  for (const partOutcome of partOutcomes) {
    const cause = chooseCause(actions, partOutcome, history) || chooseCause(children, partOutcome, history);
    if (cause) return cause;
  }
  return null;
}

/**
 * The chain of causes of an item's outcome.
 * @param item a goal, an action or a skill call
 * @returns {{item, outcome: string, text: string, path: object}[]} the effect first, the cause last
 */
export function causes(item, history) {
  const links = [];
  let cause = item;
  // a chain names no item twice
  while (cause && links.length < DEEPEST && !links.some((link) => link.item === cause)) {
    const outcome = outcomeAt(cause) || "formulated";
    links.push({ item: cause, outcome, text: sentence(cause, outcome, history), path: pathTo(cause) });
    cause = causeBelow(cause, outcome, history);
  }
  return links;
}

/** Whether a goal in execution waits for an action or a sub-goal that has not started. */
export const isBlocked = (goal, history) =>
  outcomeAt(goal) === "running" && causes(goal, history).at(-1).outcome === "formulated";

/**
 * How often the ended calls with the text of a call failed, and where:
 * "; it failed 3 of 3 times (robot1, robot2, robot1)"; "" for at most one failure.
 */
function repeatedFailures(call, { calls }) {
  const sameCalls = calls.filter(({ text, end }) => end && text === call.text),
    failedCalls = sameCalls.filter((each) => outcomeAt(each) === "failed");
  if (failedCalls.length < 2) return "";
  const robots = failedCalls.map(({ skiller }) => skiller).join(", ");
  return "; it failed " + failedCalls.length + " of " + sameCalls.length + " times (" + robots + ")";
}

/** A sentence about the outcome of an item, with its error. */
function sentence(item, outcome, history) {
  const { word } = OUTCOMES[outcome],
    isOn = isOpen(outcome);
  if (item.kind === "goal") {
    const error = isOn || outcome === "completed" ? "" : errorOf(item);
    return item.id + " " + (isOn ? "is " + item.changes.at(-1).mode : word) + (error ? ": " + error : "");
  }
  if (item.kind === "action")
    return "action " + item.id + " " + item.text + " " + (isOn ? "is " + item.changes.at(-1).state : word);
  const probably = item.guessed ? "probably " : "";
  if (isOn) return probably + item.skiller + " executes " + item.text;
  const verb = outcome === "failed" ? " could not do " : " ended ";
  const error = item.error ? ": " + item.error : "";
  return probably + item.skiller + verb + item.text + error + repeatedFailures(item, history);
}

/**
 * The deepest cause of a failed or rejected item, in words; "" for other outcomes, and without a known cause.
 */
export function reasonOf(item, history) {
  if (!["failed", "rejected"].includes(outcomeAt(item))) return "";
  const last = causes(item, history).at(-1);
  return last.item.kind === "goal" ? errorOf(last.item) || (last.item === item ? "" : last.text) : last.text;
}

/**
 * The deepest cause of the first failed root goal: a goal, an action or a call. Null: no root goal failed.
 */
export function failureOf(history) {
  const failed = forestOf(history).roots.find((goal) => outcomeAt(goal) === "failed");
  return failed ? causes(failed, history).at(-1).item : null;
}

/** The failed goals whose parent has not failed: the run goes on, or went on, in spite of these failures. */
export function overcomeFailures(history) {
  const hasFailed = (goal) => goal && outcomeAt(goal) === "failed";
  return [...history.goals.values()].filter(
    (goal) => hasFailed(goal) && history.goals.has(goal.parent) && !hasFailed(history.goals.get(goal.parent)),
  );
}

/**
 * The running calls that last much longer than all earlier calls of their skill.
 * @param now microseconds
 * @returns a Map: call -> the longest earlier duration, microseconds
 */
export function lateCalls(history, now) {
  const open = history.calls.filter(({ end }) => !end),
    longestUs = new Map(); // skill -> the longest duration of its finished calls
  // without open calls, the durations are not needed
  for (const call of open.length ? history.calls : []) {
    const skill = skillOf(call.text),
      durationUs = call.end ? call.end.time - call.begin.time : 0;
    longestUs.set(skill, Math.max(longestUs.get(skill) || 0, durationUs));
  }
  const callsAndLongest = open.map((call) => [call, longestUs.get(skillOf(call.text))]),
    isLate = ([{ begin }, beforeUs]) =>
      beforeUs && now - begin.time > Math.max(LATE_US, beforeUs * LATE_FACTOR);
  return new Map(callsAndLongest.filter(isLate));
}
