// How states look. Outcomes of goals, plan-actions and skill calls are six words; each has a hue and an icon
// of its own, so that none rests on colour alone; css/outcomes.css has the hues. cxbridge/history/outcome.py
// has the words, the icons, and which state has which outcome.
import { badge } from "cx/dom.js";

const { kinds, ended, goal, action, skill } = cx.outcomes;
/** By outcome: the word that readers see, and the icon. */
export const OUTCOMES = kinds;
export const NAMES = Object.keys(OUTCOMES);

// a recording may hold any word, such as the names of properties that each object has
const find = (table, name, other) => (Object.hasOwn(table, name) ? table[name] : other);

/** Whether a goal in this mode has an outcome. */
export const hasEnded = (mode) => ended.includes(mode);

/** Of a goal: it has an outcome from FINISHED on. @param {{mode: string, outcome: string}} goal */
export function goalOutcome({ mode, outcome }) {
  if (hasEnded(mode)) return find(goal, outcome, "retracted");
  return mode === "DISPATCHED" ? "running" : "formulated";
}

/** Of a plan-action, by its state; effects that are waited for are part of running it. */
export const actionOutcome = (state) => find(action, state, "running");

/** Of a skill call, by its status, with or without Fawkes' `S_`. */
export const skillOutcome = (status) =>
  find(skill, status, find(skill, "S_" + String(status).toUpperCase(), "formulated"));

export const isOpen = (outcome) => outcome === "formulated" || outcome === "running";

/** An outcome as an element: its icon and its word (or another text) on its hue. */
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
/** @param result of a run that is over: {status, word}, null without */
export function stateBadge(state, result = null) {
  if (!result) return badge(...(DAEMON[state] || OTHER), state);
  return badge(...(result.status ? ["failed", "✗"] : ["done", "✓"]), state + ": " + result.word);
}
