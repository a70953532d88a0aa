// Sections and notes of documents, the pages about results.
import { el } from "cx/dom.js";

export const section = (id, title, ...children) =>
  el.section({ "aria-labelledby": id }, el.h2({ id }, title), ...children);

/** A note for each text. */
export const notes = (texts) => texts.map((text) => el("p.note", { role: "note" }, text));
