// What is beside the lists of CLIPS while nothing is chosen: facts by deftemplate, the rules that fire most.
import { part } from "cx/api.js";
import { rankOf } from "cx/clips/items.js";
import { button, dim, el, link, none, note, wideTable } from "cx/dom.js";

const MOST = 25,
  OWNERS = ["the agent", "no deftemplate", "CX core"];
const overview = (title, text, heads, rows, nothing) =>
  el(
    "div#clips-overview",
    el("div.detail-head", el.h2(title)),
    note(text),
    rows.length ? wideTable({ class: "counts" }, heads, rows, [1]) : note(nothing),
  );

/** @param owners of templateOwners(); choose called with a deftemplate's name; mayChange whether facts can be changed */
export function factsOverview(facts, owners, choose, mayChange) {
  const counts = new Map();
  for (const { template } of facts) counts.set(template, (counts.get(template) || 0) + 1);
  if (!counts.size) return none("No facts", "They are listed by deftemplate here.");
  const rows = [...counts]
    .map(([template, count]) => ({ template, count, rank: rankOf(owners, template) }))
    .sort((a, b) => a.rank - b.rank || b.count - a.count || (a.template < b.template ? -1 : 1))
    .map(({ template, count, rank }) => [
      button(template, () => choose(template), { class: "link" }),
      count,
      dim(OWNERS[rank]),
    ]);
  const text = mayChange ? "Choose a fact to change or retract it." : "Choose a fact to see it.";
  return overview("Facts by deftemplate", text, ["deftemplate", "facts", "of"], rows);
}

/** @param firings(rule) how often a rule fired */
export function rulesOverview(rules, firings) {
  const rows = rules
    .map(({ name, ...rule }) => ({ name, count: firings({ name, ...rule }) }))
    .filter(({ count }) => count)
    .sort((a, b) => b.count - a.count)
    .slice(0, MOST)
    .map(({ name, count }) => [link("#/clips/rules/" + part(name), name), count + "×"]);
  return overview(
    "Rules that fired most",
    "Choose a rule for its source, and for why it has not fired.",
    ["rule", "fired"],
    rows,
    "None has fired since firings are counted: while a client has this view open.",
  );
}
