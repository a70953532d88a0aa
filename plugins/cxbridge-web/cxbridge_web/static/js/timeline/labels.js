// The names beside the lanes: what is read, and what screen readers say.
import { durationText, el } from "cx/dom.js";
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

/** What a row's label consists of. */
export function nameOf(row, history, step) {
  const { item } = row;
  if (!isLife(row))
    return el(
      "span.main-text",
      el.b(row.name),
      row.kind === "robot" ? el("span.dim", " " + item.length) : null,
    );
  const outcome = outcomeAt(item, step),
    about = item.id + " " + (item.cls || item.name || ""),
    isQuiet = outcome === "completed" || !outcome;
  const icon = el.i(
    { class: "tl-icon" + (isQuiet ? " dim" : " o-" + outcome), "aria-hidden": "true" },
    outcome ? OUTCOMES[outcome].icon : "",
  );
  const text =
    row.kind === "goal"
      ? [
          item.id.length > SHORT ? el.span(item.id.slice(0, -TAIL)) : null,
          el.span(item.id.length > SHORT ? item.id.slice(-TAIL) : item.id),
          item.cls && !item.id.includes(item.cls) ? el("span.dim", " " + item.cls) : null,
        ]
      : [el("span.dim", item.id + " "), item.text];
  return [
    icon,
    el.span({ class: "main-text" + (outcome ? "" : " dim"), "aria-hidden": "true", title: about }, text),
    el("span.hear-only", spoken(row, history, outcome)),
  ];
}

function spoken({ kind, item }, history, outcome) {
  const { ran } = timesOf(item, history),
    error = kind === "goal" ? item.changes.at(-1).error : "";
  return [
    kind === "goal" ? "goal " + item.id : "action " + item.id + " " + item.text,
    outcome ? OUTCOMES[outcome].word : "not there yet",
    ran === null ? "" : "ran " + durationText(ran),
    error,
  ]
    .filter(Boolean)
    .join(", ");
}
