// The look of states. Goals, plan-actions and skill calls have six outcomes, each with an icon and a colour:
// css/outcomes.css has the colours; cxbridge/history/outcome.py the words, the icons and the outcome of each
// state.
import { badge } from "cx/dom.js";

// of cxbridge/history/outcome.py: the outcomes, the modes of ended goals, and the outcome of each state
const { kinds, ended, goal, action, skill } = cx.outcomes;
/** By outcome: the shown word, and the icon. */
export const OUTCOMES = kinds;
export const NAMES = Object.keys(OUTCOMES);

// hasOwn, because a recording may contain any word, even `constructor`, which every object has
const lookUp = (table, name, fallback) => (Object.hasOwn(table, name) ? table[name] : fallback);

/** Whether a goal in this mode has an outcome. */
export const hasEnded = (mode) => ended.includes(mode);

/** The outcome of a goal. @param {{mode: string, outcome: string}} goal */
export function goalOutcome({ mode, outcome }) {
  if (hasEnded(mode)) return lookUp(goal, outcome, "retracted");
  return mode === "DISPATCHED" ? "running" : "formulated";
}

/** The outcome of a plan-action; an action that waits for its effects is running. */
export const actionOutcome = (state) => lookUp(action, state, "running");

/** The outcome of a skill call by its status, with or without Fawkes' `S_`. */
export const skillOutcome = (status) =>
  lookUp(skill, status, lookUp(skill, "S_" + String(status).toUpperCase(), "formulated"));

/** Whether an outcome may still change. */
export const isOpen = (outcome) => outcome === "formulated" || outcome === "running";

/** An element with the icon and the word (or another text) of an outcome, in its colour. */
export const outcomeBadge = (outcome, text = OUTCOMES[outcome].word) =>
  cx.el(
    "span",
    { class: "outcome o-" + outcome },
    cx.el("i", { "aria-hidden": "true" }, OUTCOMES[outcome].icon),
    text,
  );

const OTHER = ["other", "?"];

/** The mode of a goal, and its outcome if it has one. */
export const goalText = ({ mode, outcome }) =>
  ["", "UNKNOWN"].includes(outcome) ? mode : mode + " " + outcome;

export function skillBadge(status) {
  const name = String(status || "INACTIVE").replace(/^S_/, "");
  return outcomeBadge(skillOutcome(name), name);
}

// tone and icon of each state of the daemon and of the page
const DAEMON = {
  RUNNING: ["done", "▶"],
  PAUSED: ["active", "❙❙"],
  BREAK: ["active", "❙❙"],
  DEGRADED: ["failed", "!"],
  STARTING: ["chosen", "◔"],
  STOPPING: ["ended", "■"],
  PAST: ["refused", "◷"],
  "NO RUN": ["failed", "!"],
  READING: ["chosen", "◔"],
  RECORDING: ["refused", "◉"],
  LOST: ["failed", "✗"],
  CONNECTING: ["chosen", "◔"],
};
/** @param result {status, word} of a finished run; null for a run that continues */
export function stateBadge(state, result = null) {
  if (!result) return badge(...(DAEMON[state] || OTHER), state);
  return badge(...(result.status ? ["failed", "✗"] : ["done", "✓"]), state + ": " + result.word);
}
