// The look of states. Goals, plan-actions and skill calls have six outcomes, each with an icon and a colour:
// css/outcomes.css has the colours; cxbridge/history/outcome.py the words, the icons and the outcome of each
// state.
import { badge } from "cx/dom.js";

// of cxbridge/history/outcome.py: the outcomes, the modes of ended goals, and the outcome of each state
const { kinds, ended, goal: goalOutcomes, action: actionOutcomes, skill: skillOutcomes } = cx.outcomes;
/** By outcome: the shown word, and the icon. */
export const OUTCOMES = kinds;
export const OUTCOME_NAMES = Object.keys(OUTCOMES);

// hasOwn, because a recording may contain any word, even `constructor`, which every object has
const lookUp = (table, name, fallback) => (Object.hasOwn(table, name) ? table[name] : fallback);

/** Whether a goal in this mode has an outcome. */
export const hasEnded = (mode) => ended.includes(mode);

/** The outcome of a goal. @param {{mode: string, outcome: string}} goal */
export function goalOutcome({ mode, outcome }) {
  // a goal that ended without a known outcome was retracted, as in outcome.py
  if (hasEnded(mode)) return lookUp(goalOutcomes, outcome, "retracted");
  return mode === "DISPATCHED" ? "running" : "formulated";
}

/** The outcome of a plan-action; an action that waits for its effects is running. */
export const actionOutcome = (state) => lookUp(actionOutcomes, state, "running");

/** The outcome of a skill call by its status, with or without Fawkes' `S_`. */
export const skillOutcome = (status) =>
  lookUp(skillOutcomes, status, lookUp(skillOutcomes, "S_" + String(status).toUpperCase(), "formulated"));

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

/** The mode of a goal, and its outcome if it has one. */
export const goalText = ({ mode, outcome }) =>
  ["", "UNKNOWN"].includes(outcome) ? mode : mode + " " + outcome;

export function skillBadge(status) {
  const name = String(status || "INACTIVE").replace(/^S_/, "");
  return outcomeBadge(skillOutcome(name), name);
}

// tone and icon of each state of the daemon and of the page, and of other states
const STATE_LOOKS = {
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
const OTHER_LOOK = ["other", "?"];
/** @param result {status, word} of a finished run; null for a run that continues */
export function stateBadge(state, result = null) {
  if (!result) return badge(...(STATE_LOOKS[state] || OTHER_LOOK), state);
  return badge(...(result.status ? ["failed", "✗"] : ["done", "✓"]), state + ": " + result.word);
}
