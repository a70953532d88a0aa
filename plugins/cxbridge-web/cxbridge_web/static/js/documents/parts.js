// What documents share: sections, tables of plain values, notes.
import { el, none, wideTable } from "cx/dom.js";
import { goalOutcome, outcomeBadge } from "cx/outcome.js";

export const section = (id, title, ...children) =>
  el.section({ "aria-labelledby": id }, el.h2({ id }, title), ...children);

export const notes = (texts) => texts.map((text) => el("p.note", { role: "note" }, text));

/** The command that makes the page once more. */
export const command = (text) => el.p(el.code(text));

/**
 * A table of texts and elements.
 * @param numbers which columns are numbers
 * @param empty what is said when there is no row
 */
export function table(heads, rows, { numbers = [], caption = "", empty = "nothing" } = {}) {
  if (!rows.length) return none(empty);
  const kind = (at) => (numbers.includes(at) ? "n" : null);
  const made = wideTable(
    {},
    heads.map((head, at) => el.th({ scope: "col", class: kind(at) }, head)),
    rows.map((cells) =>
      el.tr(
        cells.map((cell, at) => el.td({ class: kind(at) }, typeof cell === "number" ? String(cell) : cell)),
      ),
    ),
  );
  if (caption) made.querySelector("table").prepend(el.caption(caption));
  return made;
}

export const percent = (part, digits = 2) => (100 * part).toFixed(digits) + " %";

/** The outcomes of goals, as badges. */
export const outcomes = (names) =>
  names.map((outcome) => [outcomeBadge(goalOutcome({ mode: "FINISHED", outcome }), outcome), " "]);

/** The modes of goals, as badges. */
export const modes = (names) =>
  names.map((mode) => [outcomeBadge(goalOutcome({ mode, outcome: "" }), mode), " "]);
