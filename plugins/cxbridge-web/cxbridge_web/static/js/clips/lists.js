// The rows of the lists of facts and rules.
import { recordedRules } from "cx/clips/source.js";
import { el } from "cx/dom.js";

const small = (text) => el("span.dim.small.wide-only", text);

const AGENT = 0,
  NO_OWNER = 1,
  CORE = 2;
/** The rank of a fact by the owner of its deftemplate; NO_OWNER for a fact without a deftemplate. */
const rankOf = ({ core, own }, template) =>
  own.has(template) ? AGENT : core.has(template) ? CORE : NO_OWNER;

/** The text of a fact, with its template in bold. */
function factText({ template, text }) {
  const head = "(" + template;
  return text.startsWith(head) ? ["(", el.b(template), text.slice(head.length)] : [text];
}

/**
 * The rows of facts: by rank, then by index.
 * @param owners see templateOwners()
 * @param matches(text) whether the search finds a text
 * @returns rows of a list in virtual.js: `key`; `sign`, which changes when the row has to be drawn again;
 * `draw()`, which makes the content; and the `fact`
 */
export function factItems(facts, owners, matches) {
  const groups = [[], [], []]; // the rows by rank
  for (const fact of facts) {
    const key = "f-" + fact.index,
      rank = rankOf(owners, fact.template),
      isCore = rank === CORE;
    if (!matches(key + " " + fact.text)) continue;
    groups[rank].push({
      key,
      sign: rank + fact.text,
      fact,
      draw: () => [
        el("span.dim.n.index", key),
        el("code.main-text", factText(fact)),
        isCore ? small("core") : null,
      ],
    });
  }
  return groups.flatMap((items) => items.sort((a, b) => a.fact.index - b.fact.index));
}

/**
 * The rules of the chosen environment of a recording: first the rules that have fired, then the remaining
 * rules of its files.
 */
export function rulesOfRecording(app) {
  const fired = [...app.model.firings.keys()]
    .filter((key) => key.startsWith(app.env + " "))
    .map((key) => ({ name: key.slice(app.env.length + 1) }));
  const names = new Set(fired.map((rule) => rule.name)),
    others = recordedRules(app.recording, app.env).filter((rule) => !names.has(rule.name));
  return [...fired, ...others].map((rule) => ({ ...rule, agenda: 0 }));
}

/**
 * The rows of rules: the agent's rules before those of the core, then rules that have fired or wait to fire
 * before the others.
 * @param firings(rule) how often a rule has fired
 * @param matches(text) whether the search finds a text
 * @returns rows as of factItems(), without `fact`
 */
export function ruleItems(rules, firings, matches) {
  const items = rules
    .filter((rule) => matches(rule.name + " " + (rule.file || "")))
    .map((rule) => ({ rule, fired: firings(rule) }));
  const rank = ({ rule, fired }) => (rule.core ? 2 : 0) + (fired || rule.agenda ? 0 : 1);
  return items
    .sort((one, other) => rank(one) - rank(other))
    .map(({ rule: { name, agenda, core, salience }, fired }) => ({
      key: "r-" + name,
      sign: fired + " " + agenda,
      draw: () => [
        el("span.main-text", name),
        agenda ? el("span.pill", agenda + " on the agenda") : null,
        fired ? el("span.dim.small.n", fired + "×") : null,
        core ? small("core") : null,
        salience ? small("salience " + salience) : null,
      ],
    }));
}
