// Sections, tables and notes of documents.
import { el, none, wideTable } from "cx/dom.js";
import { goalOutcome, outcomeBadge } from "cx/outcome.js";

export const section = (id, title, ...children) =>
  el.section({ "aria-labelledby": id }, el.h2({ id }, title), ...children);

export const notes = (texts) => texts.map((text) => el("p.note", { role: "note" }, text));
export const list = (items, entry = (item) => item) => el.ul(items.map((item) => el.li(entry(item))));

/**
 * Show a document.
 * @param head verdict; command: the command that makes the page once more; notes; kind: a class
 * @param sections lists of id, title and content; those without content are left out
 */
export function show(main, { verdict, command, notes: remarks = [], kind = "" }, sections) {
  const known = sections.filter((each) => each && each[2] !== null && each[2] !== undefined);
  main.append(
    el.div(
      { class: ("document " + kind).trim() },
      verdict instanceof Node ? verdict : verdict && el("p.verdict", { role: "status" }, verdict),
      command && el.p(el.code(command)),
      notes(remarks),
      known.map((each) => section(...each)),
    ),
  );
}

/**
 * A table of texts and elements.
 * @param numbers which columns are numbers
 * @param empty what is said when there is no row
 */
export function table(heads, rows, { numbers = [], caption = "", empty = "nothing" } = {}) {
  if (!rows.length) return none(empty);
  const made = wideTable({}, heads, rows, numbers);
  if (caption) made.querySelector("table").prepend(el.caption(caption));
  return made;
}

export const allBut1 = (heads) => heads.map((_, at) => at).slice(1);

export const outcomes = (names) =>
  names.map((outcome) => [outcomeBadge(goalOutcome({ mode: "FINISHED", outcome }), outcome), " "]);

export const modes = (names) =>
  names.map((mode) => [outcomeBadge(goalOutcome({ mode, outcome: "" }), mode), " "]);
