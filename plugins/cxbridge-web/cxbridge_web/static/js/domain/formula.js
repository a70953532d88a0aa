// Conditions of PDDL: made of the facts of a domain, evaluated, and drawn as a tree that shows which atom is
// false. A node is {type, text, satisfied (null: not known), children}.
import { el } from "cx/dom.js";

const TYPES = { conjunction: "and", disjunction: "or", negation: "not" };
const EQUALITY = "EQUALITY";

/** A formula as the API says it of a plan-action. */
export function ofApi(formula) {
  const children = (formula.child || []).map(ofApi);
  if (formula.type in TYPES || children.length) {
    if (formula.type === "atom" && children.length === 1) return children[0];
    return {
      type: formula.type,
      text: TYPES[formula.type] || formula.type,
      satisfied: formula["is-satisfied"],
      children,
    };
  }
  const values = formula["param-values"] || [];
  return {
    type: "atom",
    text: "(" + [formula.name, ...values].join(" ") + ")",
    satisfied: formula["is-satisfied"],
    children,
  };
}

/** The arguments of an atom: constants stand in the place of parameters. */
function argumentsOf(atom, binding) {
  return atom.names.map((name, at) => {
    const constant = atom.constants[at];
    if (constant && constant !== "nil") return constant;
    return binding.get(name) || "?" + name;
  });
}

/** How many facts an atom with open parameters fits. */
function countMatching(words, facts) {
  let count = 0;
  for (const fact of facts) {
    const others = fact.split(" ");
    if (
      others.length === words.length &&
      words.every((word, at) => word.startsWith("?") || word === others[at])
    )
      count += 1;
  }
  return count;
}

/** @param facts a Set of "name argument ..." that are true */
export function evaluated(formula, binding, facts) {
  if (formula.type === "atom") {
    const values = argumentsOf(formula, binding),
      isOpen = values.some((value) => value.startsWith("?"));
    const name = formula.name === EQUALITY ? "=" : formula.name;
    const words = [formula.name, ...values],
      matching = isOpen && formula.name !== EQUALITY ? countMatching(words, facts) : 0;
    return {
      type: "atom",
      text: "(" + [name, ...values].join(" ") + ")",
      note: matching ? matching + (matching === 1 ? " fact matches" : " facts match") : "",
      satisfied: isOpen
        ? matching || formula.name === EQUALITY
          ? null
          : false // with any arguments
        : formula.name === EQUALITY
          ? values[0] === values[1]
          : facts.has(words.join(" ")),
      children: [],
    };
  }
  const children = formula.children.map((child) => evaluated(child, binding, facts)),
    all = children.map((child) => child.satisfied);
  const satisfied =
    formula.type === "negation"
      ? all[0] === null || all[0] === undefined
        ? null
        : !all[0]
      : formula.type === "disjunction"
        ? all.includes(true) || (all.includes(null) ? null : false)
        : all.includes(false)
          ? false
          : !all.includes(null) || null;
  return { type: formula.type, text: TYPES[formula.type] || formula.type, satisfied, children };
}

const LOOKS = new Map([
  [true, ["completed", "✓", "true"]],
  [false, ["failed", "✗", "false"]],
  [null, ["formulated", "–", "not known"]],
]);

export function formulaTree(node) {
  const [outcome, icon, word] = LOOKS.get(node.satisfied ?? null);
  return el(
    "ul.formula",
    el.li(
      { class: node.satisfied === false ? "is-false" : "" },
      el.i({ class: "dot outcome o-" + outcome, title: word, role: "img", "aria-label": word }, icon),
      el.code(node.text),
      node.note ? el("span.dim.small", "  " + node.note) : null,
      node.children.map(formulaTree),
    ),
  );
}
