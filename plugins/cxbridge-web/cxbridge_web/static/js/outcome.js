// Outcomes: what became of a goal, a plan-action or a skill call, in one of six words. Each has a hue, a
// texture and an icon of its own, so that none rests on colour alone; css/outcomes.css has the hues and the
// textures for elements, js/timeline/texture.js draws the same textures on a canvas.

/** By outcome: the word that readers see, the icon, and the name of the texture. */
export const OUTCOMES = {
  formulated: { word: "waiting", icon: "○", texture: "dots" },
  running: { word: "running", icon: "▶", texture: "stripes" },
  completed: { word: "completed", icon: "✓", texture: "plain" },
  failed: { word: "failed", icon: "✗", texture: "crosses" },
  rejected: { word: "rejected", icon: "⊘", texture: "lines" },
  retracted: { word: "retracted", icon: "·", texture: "plain" },
};
export const NAMES = Object.keys(OUTCOMES);

// recordings hold any words, those that every object knows, too
const find = (table, name, other) => (Object.hasOwn(table, name) ? table[name] : other);

const OF_GOAL = { COMPLETED: "completed", FAILED: "failed", REJECTED: "rejected" };
const ENDED = new Set(["FINISHED", "EVALUATED", "RETRACTED"]);

/** Of a goal: it has an outcome from FINISHED on. @param {{mode: string, outcome: string}} goal */
export function goalOutcome({ mode, outcome }) {
  if (ENDED.has(mode)) return find(OF_GOAL, outcome, "retracted");
  return mode === "DISPATCHED" ? "running" : "formulated";
}

const OF_ACTION = {
  FORMULATED: "formulated",
  PENDING: "formulated",
  WAITING: "formulated",
  FINAL: "completed",
  "EXECUTION-FAILED": "failed",
  FAILED: "failed",
};
/** Of a plan-action, by its state; effects that are waited for are part of running it. */
export const actionOutcome = (state) => find(OF_ACTION, state, "running");

const OF_SKILL = { RUNNING: "running", FINAL: "completed", FAILED: "failed", STOPPED: "retracted" };
/** Of a skill call, by its status, with or without Fawkes' `S_`. */
export const skillOutcome = (status) =>
  find(OF_SKILL, String(status).replace(/^S_/, "").toUpperCase(), "formulated");

/** Whether it goes on. */
export const isOpen = (outcome) => outcome === "formulated" || outcome === "running";

/** An outcome as an element: its icon and its word (or another text) on its hue and texture. */
export const outcomeBadge = (outcome, text = OUTCOMES[outcome].word) =>
  cx.el(
    "span",
    { class: "outcome o-" + outcome },
    cx.el("i", { "aria-hidden": "true" }, OUTCOMES[outcome].icon),
    text,
  );
