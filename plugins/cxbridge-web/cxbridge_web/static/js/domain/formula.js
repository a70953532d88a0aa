// Conditions of PDDL: made of the facts of a domain, evaluated, and drawn as a tree that shows which atom is
// false. A node is {type, text, satisfied (null: not known), children}.
import { el, plural } from "cx/dom.js";

const TYPES = { conjunction: "and", disjunction: "or", negation: "not" };
const EQUALITY = "EQUALITY";
const atomText = (...words) => "(" + words.join(" ") + ")";

export function ofApi({ type, child = [], name, "param-values": values = [], "is-satisfied": satisfied }) {
  const children = child.map(ofApi);
  if (type === "atom" && children.length === 1) return children[0];
  if (type in TYPES || children.length) return { type, text: TYPES[type] || type, satisfied, children };
  return { type: "atom", text: atomText(name, ...values), satisfied, children };
}

const countMatching = (words, facts) =>
  [...facts]
    .map((fact) => fact.split(" "))
    .filter(({ length }) => length === words.length)
    .filter((found) => words.every((word, at) => word.startsWith("?") || word === found[at])).length;

function evaluatedAtom({ name, names, constants }, binding, facts) {
  // constants stand in the place of parameters
  const isGiven = (constant) => constant && constant !== "nil",
    values = names.map((each, at) =>
      isGiven(constants[at]) ? constants[at] : binding.get(each) || "?" + each,
    ),
    isOpen = values.some((value) => value.startsWith("?")),
    isEquality = name === EQUALITY,
    words = [name, ...values],
    matching = isOpen && !isEquality ? countMatching(words, facts) : 0,
    known = isEquality ? values[0] === values[1] : facts.has(words.join(" "));
  return {
    type: "atom",
    text: atomText(isEquality ? "=" : name, ...values),
    note: matching ? plural(matching, "fact") + (matching === 1 ? " matches" : " match") : "",
    // an atom with open parameters that fits no fact is false with any arguments
    satisfied: !isOpen ? known : matching || isEquality ? null : false,
    children: [],
  };
}

const CONNECTIVES = {
  negation: ([first = null]) => (first === null ? null : !first),
  disjunction: (all) => all.includes(true) || (all.includes(null) ? null : false),
  conjunction: (all) => (all.includes(false) ? false : !all.includes(null) || null),
};

/** @param facts a Set of "name argument ..." that are true */
export function evaluated(formula, binding, facts) {
  const { type } = formula;
  if (type === "atom") return evaluatedAtom(formula, binding, facts);
  const children = formula.children.map((child) => evaluated(child, binding, facts)),
    join = CONNECTIVES[type] || CONNECTIVES.conjunction;
  return {
    type,
    text: TYPES[type] || type,
    satisfied: join(children.map((child) => child.satisfied)),
    children,
  };
}

const LOOKS = new Map([
  [true, ["completed", "✓", "true"]],
  [false, ["failed", "✗", "false"]],
  [null, ["formulated", "–", "not known"]],
]);

export function formulaTree({ satisfied, text, note, children }) {
  const [outcome, icon, word] = LOOKS.get(satisfied ?? null);
  return el(
    "ul.formula",
    el.li(
      { class: satisfied === false ? "is-false" : "" },
      el.i({ class: "dot outcome o-" + outcome, title: word, role: "img", "aria-label": word }, icon),
      el.code(text),
      note ? el("span.dim.small", "  " + note) : null,
      children.map(formulaTree),
    ),
  );
}
