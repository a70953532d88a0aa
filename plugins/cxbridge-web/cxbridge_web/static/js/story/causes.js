// Causes of failures and waits in the events: from a goal down to its sub-goal, action and skill call. The
// server's `why` also knows rules and facts: js/why.js.
import { forestOfGoals } from "cx/forest.js";
import { skillOf } from "cx/names.js";
import { isOpen, OUTCOMES } from "cx/outcome.js";
import { pathTo } from "cx/timeline/host.js";
import { ofLastAttempt } from "cx/timeline/history.js";
import { outcomeAt, timesOf } from "cx/timeline/spans.js";

const DEEPEST = 50,
  LATE_FACTOR = 2, // of the longest time before
  LATE_US = 5e6; // shorter calls are not late

const forests = new WeakMap(); // history -> its roots, the goals below each goal, and their shape

/** The trees of the goals of a history: {roots, children: key -> goals}. */
export function forestOf(history) {
  const before = forests.get(history),
    { shape } = history;
  if (before && before.shape === shape) return before;
  const forest = { shape, ...forestOfGoals([...history.goals.values()]) };
  forests.set(history, forest);
  return forest;
}

/** An error of the core in words: SUB-GOAL-FAILED gen20 is "sub-goal failed: gen20". */
export const inWords = (error) =>
  error.replace(
    /^([A-Z]+(?:-[A-Z]+)+|TIMEOUT)\b ?(.*)$/s,
    (_, code, more) =>
      code.toLowerCase().replaceAll("-", " ").replace("sub goal", "sub-goal") + (more ? ": " + more : ""),
  );
export const errorOf = (goal) =>
  inWords((goal.changes.findLast(({ error }) => error) || { error: "" }).error);

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
 * Of the items with an outcome, the open item with open actions that began first, since a goal without a plan may
 * wait for the end of another goal; else the item that ended last.
 */
function oneOf(items, outcome, history) {
  const found = items.filter((each) => outcomeAt(each) === outcome);
  if (isOpen(outcome)) return found.find((each) => hasOpenWork(each, history)) || found[0];
  return found.sort((a, b) => endOf(a, history) - endOf(b, history)).at(-1);
}

function below(item, outcome, history) {
  if (item.kind === "skill" || outcome === "completed") return null;
  if (item.kind === "action") return oneOf(item.calls, outcome, history) || null;
  const actions = ofLastAttempt(item, item.actions),
    children = ofLastAttempt(item, forestOf(history).children.get(item.key) || []);
  const wanted = { rejected: ["rejected", "failed"], running: ["running", "formulated"] }[outcome] || [
    outcome,
  ];
  for (const each of wanted) {
    const cause = oneOf(actions, each, history) || oneOf(children, each, history);
    if (cause) return cause;
  }
  return null;
}

/**
 * @param item a goal, an action or a skill call
 * @returns {{item, outcome: string, text: string, path: object}[]} the effect first, the cause last
 */
export function causes(item, history) {
  const found = [];
  let at = item;
  while (at && found.length < DEEPEST && !found.some((each) => each.item === at)) {
    const outcome = outcomeAt(at) || "formulated";
    found.push({ item: at, outcome, text: sentence(at, outcome, history), path: pathTo(at) });
    at = below(at, outcome, history);
  }
  return found;
}

/** Whether a goal in execution waits for an action that has not started. */
export const isBlocked = (goal, history) =>
  outcomeAt(goal) === "running" && causes(goal, history).at(-1).outcome === "formulated";

/** How often a failed skill failed, and where: "; it failed 3 of 3 times (robot1, robot2, robot1)". */
function repeated(call, { calls }) {
  const same = calls.filter(({ text, end }) => end && text === call.text),
    failed = same.filter((each) => outcomeAt(each) === "failed");
  if (failed.length < 2) return "";
  const robots = failed.map(({ skiller }) => skiller).join(", ");
  return "; it failed " + failed.length + " of " + same.length + " times (" + robots + ")";
}

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
  const could = outcome === "failed" ? " could not do " : " ended ";
  const error = item.error ? ": " + item.error : "";
  return probably + item.skiller + could + item.text + error + repeated(item, history);
}

/** The first cause of a failed or rejected item, in words; "" for other outcomes. */
export function reasonOf(item, history) {
  if (!["failed", "rejected"].includes(outcomeAt(item))) return "";
  const last = causes(item, history).at(-1);
  return last.item.kind === "goal" ? errorOf(last.item) || (last.item === item ? "" : last.text) : last.text;
}

/** The first cause of the first failure of a run; null: nothing failed. */
export function failureOf(history) {
  const failed = forestOf(history).roots.find((goal) => outcomeAt(goal) === "failed");
  return failed ? causes(failed, history).at(-1).item : null;
}

/** Failed goals below a goal that did not fail: the run recovered. */
export function overcome(history) {
  const isBad = (goal) => goal && outcomeAt(goal) === "failed";
  return [...history.goals.values()].filter(
    (goal) => isBad(goal) && history.goals.has(goal.parent) && !isBad(history.goals.get(goal.parent)),
  );
}

/**
 * The running calls that last much longer than all earlier calls of their skill.
 * @param now microseconds
 * @returns a Map: call -> the longest earlier duration
 */
export function lateCalls(history, now) {
  const open = history.calls.filter(({ end }) => !end),
    longest = new Map(); // skill -> microseconds
  for (const call of open.length ? history.calls : []) {
    const skill = skillOf(call.text),
      took = call.end ? call.end.time - call.begin.time : 0;
    longest.set(skill, Math.max(longest.get(skill) || 0, took));
  }
  const found = open.map((call) => [call, longest.get(skillOf(call.text))]),
    isLate = ([{ begin }, before]) => before && now - begin.time > Math.max(LATE_US, before * LATE_FACTOR);
  return new Map(found.filter(isLate));
}
