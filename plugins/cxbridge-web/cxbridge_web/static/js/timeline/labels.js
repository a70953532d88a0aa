// The names beside the lanes: what is read, and what screen readers say.
import { dim, durationText, el } from "cx/dom.js";
import { OUTCOMES } from "cx/outcome.js";
import { outcomeAt, timesOf } from "cx/timeline/spans.js";

const SHORT = 14,
  TAIL = 6; // characters of a name that are always seen: they tell goals of a class apart
const isLife = ({ kind }) => kind === "goal" || kind === "action";

/** Changes when a row has to be drawn again. @param step the moment */
export function signOf(row, step) {
  if (!isLife(row)) return row.depth + " " + row.open + " " + row.item.length;
  const { changes, cls } = row.item;
  return [row.depth, row.open, outcomeAt(row.item, step), changes.length, cls].join("|");
}

function goalName({ id, cls }) {
  const isLong = id.length > SHORT;
  return [
    isLong && el.span(id.slice(0, -TAIL)),
    el.span(isLong ? id.slice(-TAIL) : id),
    cls && !id.includes(cls) && dim(" " + cls),
  ];
}

/** What a row's label consists of. */
export function nameOf(row, history, step) {
  const { item, kind } = row;
  if (!isLife(row)) return el("span.main-text", el.b(row.name), kind === "robot" && dim(" " + item.length));
  const outcome = outcomeAt(item, step),
    title = item.id + " " + (item.cls || item.name || ""),
    tone = outcome === "completed" || !outcome ? " dim" : " o-" + outcome,
    text = kind === "goal" ? goalName(item) : [dim(item.id + " "), item.text];
  return [
    el.i({ class: "tl-icon" + tone, "aria-hidden": "true" }, outcome ? OUTCOMES[outcome].icon : ""),
    el.span({ class: "main-text" + (outcome ? "" : " dim"), "aria-hidden": "true", title }, text),
    el("span.hear-only", spoken(row, history, outcome)),
  ];
}

function spoken({ kind, item }, history, outcome) {
  const { ran } = timesOf(item, history),
    parts = [
      kind === "goal" ? "goal " + item.id : "action " + item.id + " " + item.text,
      outcome ? OUTCOMES[outcome].word : "not there yet",
      ran === null ? "" : "ran " + durationText(ran),
      kind === "goal" ? item.changes.at(-1).error : "",
    ];
  return parts.filter(Boolean).join(", ");
}
