// Why something ended as it did, or goes on: from a goal down to the sub-goal, action, skill and log line behind it.
import { OUTCOMES } from "cx/outcome.js";
import { outcomeAt, timesOf } from "cx/timeline/spans.js";
import { pathTo } from "cx/timeline/path.js";

const DEEPEST = 50,
  LINES = 3,
  LATE_US = 200_000; // a line about an end comes after it

const lastError = (goal) => (goal.changes.findLast(({ error }) => error) || { error: "" }).error;
const endOf = (item, history) => (timesOf(item, history).end || history.end).step;

/** The one of several with an outcome that ended last. */
const lastOf = (items, outcome, history) =>
  items
    .filter((each) => outcomeAt(each) === outcome)
    .sort((a, b) => endOf(a, history) - endOf(b, history))
    .at(-1);

/**
 * @param item a goal, an action or a skill call
 * @returns {{item, outcome: string, text: string, path: object}[]} the effect first, the cause last
 */
export function causes(item, history) {
  const found = [];
  let at = item;
  while (at && found.length < DEEPEST && !found.some((each) => each.item === at)) {
    const outcome = outcomeAt(at) || "formulated";
    found.push({ item: at, outcome, text: sentence(at, outcome), path: pathTo(at) });
    at = below(at, outcome, history);
  }
  return found;
}

function below(item, outcome, history) {
  if (item.kind === "skill" || outcome === "completed") return null;
  if (item.kind === "action") return lastOf(item.calls, outcome, history) || null;
  const children = [...history.goals.values()].filter((goal) => goal.parent === item.key);
  const wanted = outcome === "rejected" ? ["rejected", "failed"] : [outcome];
  for (const each of wanted) {
    const cause = lastOf(item.actions, each, history) || lastOf(children, each, history);
    if (cause) return cause;
  }
  return null;
}

function sentence(item, outcome) {
  const { word } = OUTCOMES[outcome],
    is = outcome === "running" || outcome === "formulated" ? "is " + word : word;
  if (item.kind === "goal") {
    const error = outcome === "failed" || outcome === "rejected" ? lastError(item) : "";
    return "Goal " + item.id + " " + is + (error ? ": " + error : "");
  }
  if (item.kind === "action")
    return "Action " + item.id + " " + item.text + " " + is + " (" + item.changes.at(-1).state + ")";
  return (
    (item.guessed ? "probably " : "") +
    item.skiller +
    " " +
    (is === word ? "ended" : "runs") +
    " " +
    item.text +
    (item.error ? ": " + item.error : "")
  );
}

/** The errors of the log that belong to the last cause: those when it ended, the latest last. */
export function errorsAt(item, history) {
  const { begin, end } = timesOf(item, history),
    from = begin.time,
    to = end ? end.time + LATE_US : history.time;
  const during = history.errors.filter(({ time }) => time >= from && time <= to),
    id = item.kind === "goal" ? item.id : "";
  const named = during.filter(({ text }) => id && text.includes(id));
  return (named.length ? named : during).slice(-LINES);
}
