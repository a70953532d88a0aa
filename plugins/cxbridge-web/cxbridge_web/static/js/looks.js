// How states look: the same tones and icons as in reports on recorded runs.
import LOOKS from "../shared/looks.js";
import { badge } from "./dom.js";

const OTHER = ["other", "?"];
const of = (kind, state) => LOOKS[kind][state] || OTHER;
const ENDED = new Set(["FINISHED", "EVALUATED", "RETRACTED"]);

export const MODES = Object.keys(LOOKS.mode);
export const hasOutcome = (goal) => goal.outcome in LOOKS.outcome;
export const goalLook = (goal) =>
  hasOutcome(goal) && ENDED.has(goal.mode) ? of("outcome", goal.outcome) : of("mode", goal.mode);
export const goalText = (goal) => (hasOutcome(goal) ? goal.mode + " " + goal.outcome : goal.mode);
export const actionLook = (state) => of("action", state);
export const goalBadge = (goal) => badge(...goalLook(goal), goalText(goal));
export const actionBadge = (state) => badge(...actionLook(state), state);

/** A skill's status, with or without Fawkes' `S_`. */
export function skillBadge(status) {
  const name = String(status || "INACTIVE").replace(/^S_/, "");
  return badge(...of("skill", "S_" + name), name);
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
