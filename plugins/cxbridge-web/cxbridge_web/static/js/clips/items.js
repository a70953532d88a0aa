// The rows of the lists of CLIPS: facts, rules, agenda.
import { el } from "cx/dom.js";
import { recordedRules } from "cx/clips/constructs.js";

function inOrder(items) {
  for (let at = 1; at < items.length; at++)
    if (items[at].fact.index < items[at - 1].fact.index)
      return items.sort((a, b) => a.fact.index - b.fact.index);
  return items;
}
function factText(fact) {
  const head = "(" + fact.template;
  return fact.text.startsWith(head) ? ["(", el.b(fact.template), fact.text.slice(head.length)] : [fact.text];
}

/**
 * @param facts all that are known
 * @param owners core, own: which deftemplates are the CX core's, which the agent's: the agent's come first
 * @param wanted what a fact must contain, in lower case
 */
export function factItems(facts, { core, own }, wanted) {
  const groups = [[], [], []];
  const rank = ({ template }) => (own.has(template) ? 0 : core.has(template) ? 2 : 1);
  for (const fact of facts) {
    if (wanted && !("f-" + fact.index + " " + fact.text).toLowerCase().includes(wanted)) continue;
    const isCore = core.has(fact.template);
    groups[rank(fact)].push({
      key: "f-" + fact.index,
      sign: fact.text,
      fact,
      rowClass: isCore ? "of-core" : "",
      draw: () => [
        el("span.dim.n.index", "f-" + fact.index),
        el("code.main-text", factText(fact)),
        isCore ? el("span.dim.small.wide-only", "core") : null,
      ],
    });
  }
  return groups.flatMap(inOrder);
}

/** The rules of a recording: those that have fired, then the others of its files. */
export function rulesOfRecording(app) {
  const fired = [...app.model.firings.keys()]
    .filter((key) => key.startsWith(app.env + " "))
    .map((key) => ({ name: key.slice(app.env.length + 1), agenda: 0 }));
  const names = new Set(fired.map((rule) => rule.name));
  const others = recordedRules(app.recording, app.env)
    .filter((rule) => !names.has(rule.name))
    .map((rule) => ({ ...rule, agenda: 0 }));
  return [...fired, ...others];
}

/** @param firings how often a rule has fired */
export function ruleItems(rules, firings, { wanted, onlyFired }) {
  return [...rules]
    .sort((a, b) => Number(Boolean(a.core)) - Number(Boolean(b.core)))
    .filter(
      (rule) =>
        (!wanted || (rule.name + " " + (rule.file || "")).toLowerCase().includes(wanted)) &&
        (!onlyFired || firings(rule) || rule.agenda),
    )
    .map((rule) => {
      const fired = firings(rule);
      return {
        key: "r-" + rule.name,
        sign: fired + " " + rule.agenda,
        rule,
        draw: () => [
          el("span.main-text", rule.name),
          rule.agenda ? el("span.pill", rule.agenda + " on the agenda") : null,
          fired ? el("span.dim.small.n", fired + "×") : null,
          rule.core ? el("span.dim.small.wide-only", "core") : null,
          rule.salience ? el("span.dim.small.n.wide-only", "salience " + rule.salience) : null,
        ],
      };
    });
}

export function agendaItems(agenda, wanted) {
  return agenda
    .filter((each) => !wanted || (each.rule + " " + each.basis).toLowerCase().includes(wanted))
    .map((each, at) => ({
      key: "a-" + at,
      sign: each.rule + each.basis,
      rule: { name: each.rule },
      draw: () => [
        el("span.dim.n.index", String(each.salience)),
        el("span.main-text", each.rule),
        el("code.dim.small", each.basis),
      ],
    }));
}
