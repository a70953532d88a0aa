// How states look that are no outcomes of goals, actions or skills alone.
import { badge } from "cx/dom.js";
import { outcomeBadge, skillOutcome } from "cx/outcome.js";

const OTHER = ["other", "?"];

/** The mode of a goal, and its outcome when it has one. */
export const goalText = ({ mode, outcome }) =>
  ["", "UNKNOWN"].includes(outcome) ? mode : mode + " " + outcome;

/** A skill's status, with or without Fawkes' `S_`. */
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

const COMPONENT = {
  active: ["done", "✓"],
  inactive: ["ended", "■"],
  unconfigured: ["new", "○"],
  finalized: ["gone", "·"],
};
export const componentBadge = (state) =>
  badge(...(COMPONENT[String(state).toLowerCase()] || OTHER), String(state).toLowerCase());
