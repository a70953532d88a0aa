// The look of states. Goals, plan-actions and skill calls have six outcomes, each with an icon and a colour:
// css/outcomes.css has the colours; cxbridge/history/outcome.py the words, the icons and the outcome of each
// state.
import { badge } from "cx/dom.js";

const { kinds, ended, goal, action, skill } = cx.outcomes;
/** By outcome: the shown word, and the icon. */
export const OUTCOMES = kinds;
export const NAMES = Object.keys(OUTCOMES);

// a recording may contain any word, also the name of a property of every object
const find = (table, name, other) => (Object.hasOwn(table, name) ? table[name] : other);

/** Whether a goal in this mode has an outcome. */
export const hasEnded = (mode) => ended.includes(mode);

/** The outcome of a goal. @param {{mode: string, outcome: string}} goal */
export function goalOutcome({ mode, outcome }) {
  if (hasEnded(mode)) return find(goal, outcome, "retracted");
  return mode === "DISPATCHED" ? "running" : "formulated";
}

/** The outcome of a plan-action; an action that waits for its effects is running. */
export const actionOutcome = (state) => find(action, state, "running");

/** The outcome of a skill call by its status, with or without Fawkes' `S_`. */
export const skillOutcome = (status) =>
  find(skill, status, find(skill, "S_" + String(status).toUpperCase(), "formulated"));

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
/** @param result {status, word} of a finished run; null for a running one */
export function stateBadge(state, result = null) {
  if (!result) return badge(...(DAEMON[state] || OTHER), state);
  return badge(...(result.status ? ["failed", "✗"] : ["done", "✓"]), state + ": " + result.word);
}
