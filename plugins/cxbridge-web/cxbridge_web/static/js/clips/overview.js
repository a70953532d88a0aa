// What is beside the lists of CLIPS while nothing is chosen: facts by deftemplate, the rules that fire most.
import { part } from "cx/api.js";
import { button, el, none, wideTable } from "cx/dom.js";

const MOST = 25;

/** @param owners of templateOwners(); choose called with a deftemplate's name; mayChange whether facts can be changed */
export function factsOverview(facts, { core, own }, choose, mayChange) {
  const counts = new Map();
  for (const fact of facts) counts.set(fact.template, (counts.get(fact.template) || 0) + 1);
  if (!counts.size) return none("No facts", "They are listed by deftemplate here.");
  const rank = (template) => (own.has(template) ? 0 : core.has(template) ? 2 : 1);
  const sorted = [...counts].sort(
    ([a, many], [b, more]) => rank(a) - rank(b) || more - many || (a < b ? -1 : 1),
  );
  return el(
    "div#clips-overview",
    el("div.detail-head", el.h2("Facts by deftemplate")),
    el("p.dim", mayChange ? "Choose a fact to change or retract it." : "Choose a fact to see it."),
    wideTable(
      { class: "counts" },
      ["deftemplate", "facts", "of"],
      sorted.map(([template, count]) =>
        el.tr(
          el.td(button(template, () => choose(template), { class: "link" })),
          el("td.n", String(count)),
          el("td.dim", ["the agent", "no deftemplate", "CX core"][rank(template)]),
        ),
      ),
    ),
  );
}

/** @param firings(rule) how often a rule fired */
export function rulesOverview(rules, firings) {
  const fired = rules
    .map((rule) => ({ rule, count: firings(rule) }))
    .filter((each) => each.count)
    .sort((a, b) => b.count - a.count);
  return el(
    "div#clips-overview",
    el("div.detail-head", el.h2("Rules that fired most")),
    el("p.dim", "Choose a rule for its source, and for why it has not fired."),
    fired.length
      ? wideTable(
          { class: "counts" },
          ["rule", "fired"],
          fired
            .slice(0, MOST)
            .map(({ rule, count }) =>
              el.tr(
                el.td(el.a({ href: "#/clips/rules/" + part(rule.name) }, rule.name)),
                el("td.n", count + "×"),
              ),
            ),
        )
      : el("p.dim", "None has fired since firings are counted: while somebody has this view open."),
  );
}
