// The rows of the lists of CLIPS: facts, rules, agenda; and what is beside the lists while nothing is chosen.
import { part } from "cx/api.js";
import { recordedRules } from "cx/clips/source.js";
import { button, dim, el, link, none, note, wideTable } from "cx/dom.js";

const small = (text) => el("span.dim.small.wide-only", text);

/** The order of facts by the owner of their deftemplate, of templateOwners(): the agent's come first. */
export const rankOf = ({ core, own }, template) => (own.has(template) ? 0 : core.has(template) ? 2 : 1);

function factText({ template, text }) {
  const head = "(" + template;
  return text.startsWith(head) ? ["(", el.b(template), text.slice(head.length)] : [text];
}

/**
 * @param owners of templateOwners()
 * @param matches whether a text is searched
 */
export function factItems(facts, owners, matches) {
  const groups = [[], [], []];
  for (const fact of facts) {
    const key = "f-" + fact.index,
      rank = rankOf(owners, fact.template),
      isCore = rank === 2;
    if (!matches(key + " " + fact.text)) continue;
    groups[rank].push({
      key,
      sign: fact.text,
      fact,
      rowClass: isCore ? "of-core" : "",
      draw: () => [
        el("span.dim.n.index", key),
        el("code.main-text", factText(fact)),
        isCore ? small("core") : null,
      ],
    });
  }
  return groups.flatMap((items) => items.sort((a, b) => a.fact.index - b.fact.index));
}

/** The rules of a recording: first the rules that have fired, then the remaining rules of its files. */
export function rulesOfRecording(app) {
  const fired = [...app.model.firings.keys()]
    .filter((key) => key.startsWith(app.env + " "))
    .map((key) => ({ name: key.slice(app.env.length + 1) }));
  const names = new Set(fired.map((rule) => rule.name)),
    others = recordedRules(app.recording, app.env).filter((rule) => !names.has(rule.name));
  return [...fired, ...others].map((rule) => ({ ...rule, agenda: 0 }));
}

export const ruleItems = (rules, firings, matches, onlyFired) =>
  [...rules]
    .sort((a, b) => Number(Boolean(a.core)) - Number(Boolean(b.core)))
    .map((rule) => ({ rule, fired: firings(rule) }))
    .filter(
      ({ rule, fired }) =>
        matches(rule.name + " " + (rule.file || "")) && (!onlyFired || fired || rule.agenda),
    )
    .map(({ rule, fired }) => ({
      key: "r-" + rule.name,
      sign: fired + " " + rule.agenda,
      rule,
      draw: () => [
        el("span.main-text", rule.name),
        rule.agenda ? el("span.pill", rule.agenda + " on the agenda") : null,
        fired ? el("span.dim.small.n", fired + "×") : null,
        rule.core ? small("core") : null,
        rule.salience ? small("salience " + rule.salience) : null,
      ],
    }));

export const agendaItems = (agenda, matches) =>
  agenda
    .filter(({ rule, basis }) => matches(rule + " " + basis))
    .map(({ rule, basis, salience }, at) => ({
      key: "a-" + at,
      sign: rule + basis,
      rule: { name: rule },
      draw: () => [
        el("span.dim.n.index", String(salience)),
        el("span.main-text", rule),
        el("code.dim.small", basis),
      ],
    }));

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
