// The operators of a domain, made of the facts of the executive: parameters, precondition and effects, with
// what is true and false now for arguments that can be chosen.
import { slotsBy } from "cx/clips/text.js";
import { button, dim, el, field, note, refill, textInput } from "cx/dom.js";
import { evaluated, formulaTree } from "cx/domain/formula.js";

export const TEMPLATES = [
  "domain-operator",
  "domain-operator-parameter",
  "domain-effect",
  "domain-object",
  "domain-object-type",
  "domain-fact",
  "pddl-formula",
  "pddl-predicate",
];
const DEEPEST = 30; // formulas that are part of each other end

const atomOf = ({ all, first }) => ({
  type: "atom",
  name: first("predicate"),
  names: all("param-names"),
  constants: all("param-constants"),
});

export function readDomain(facts) {
  const of = slotsBy(new Map(facts.map((fact) => [fact.text, fact])).values());
  const partsOf = (template, whole) => of(template).filter(({ first }) => first("part-of") === whole);

  function formulas(whole, depth = 0) {
    if (depth > DEEPEST) return [];
    const inner = partsOf("pddl-formula", whole).flatMap(({ first }) => {
      const children = formulas(first("id"), depth + 1);
      return first("type") === "atom" ? children : [{ type: first("type"), children }];
    });
    return [...inner, ...partsOf("pddl-predicate", whole).map(atomOf)];
  }
  const conditionOf = (whole) => {
    const found = formulas(whole);
    return found.length > 1 ? { type: "conjunction", children: found } : found[0] || null;
  };
  const effectOf = (effect) => ({
    positive: effect.first("type") !== "NEGATIVE",
    atom: atomOf(effect),
    condition: conditionOf(effect.first("name")),
  });
  const operators = of("domain-operator").map(({ all, first }) => {
    const name = first("name"),
      own = of("domain-operator-parameter").filter((each) => each.first("operator") === name),
      types = new Map(own.map((each) => [each.first("name"), each.first("type")]));
    return {
      name,
      waitsForSensing: first("wait-sensed") !== "FALSE",
      exogenous: first("exogenous") === "TRUE",
      parameters: all("param-names").map((each) => ({ name: each, type: types.get(each) || "object" })),
      precondition: conditionOf(name),
      effects: partsOf("domain-effect", name).map(effectOf),
    };
  });
  const words = of("domain-fact").map(({ all, first }) => [first("name"), ...all("param-values")]),
    objects = of("domain-object").map(({ first }) => first("name"));
  return {
    operators: operators.sort((a, b) => (a.name < b.name ? -1 : 1)),
    facts: new Set(words.map((each) => each.join(" "))),
    /** Objects, and what facts are about (constants are no objects). */
    values: [...new Set([...objects, ...words.flatMap(([, ...values]) => values)])].sort(),
  };
}

function effectItem({ positive, atom, condition }, binding, facts) {
  const holds = condition && evaluated(condition, binding, facts);
  return el.li(
    el.b({ class: positive ? "plus" : "minus" }, positive ? "+" : "−"),
    el("span.hear-only", positive ? "becomes true: " : "becomes false: "),
    " ",
    el.code(evaluated(atom, binding, new Set()).text),
    holds && el.div(dim("when"), formulaTree(holds)),
  );
}
const truth = (satisfied) =>
  satisfied === null
    ? "with the arguments above it can be evaluated"
    : satisfied
      ? "is true now"
      : "is false now";

/**
 * @param domain of readDomain()
 * @param binding Map parameter -> argument; what is typed goes into it
 * @param calls of this operator in plans: [{label, values}]
 */
export function operatorView(domain, operator, binding, calls) {
  const body = el("div#operator-state"),
    { parameters, precondition, effects, exogenous, waitsForSensing } = operator;
  function draw() {
    const known = precondition && evaluated(precondition, binding, domain.facts),
      items = effects.map((effect) => effectItem(effect, binding, domain.facts));
    refill(
      body,
      el.h3("Precondition ", known && dim(truth(known.satisfied))),
      known ? formulaTree(known) : note("none: it is always applicable"),
      el.h3("Effects"),
      items.length ? el("ul.effects", items) : note("none"),
    );
  }
  const inputs = parameters.map(({ name }) => {
    const input = textInput({ list: "domain-values", value: binding.get(name) || "" });
    input.addEventListener("input", () => {
      if (input.value.trim()) binding.set(name, input.value.trim());
      else binding.delete(name);
      draw();
    });
    return input;
  });
  function take(values) {
    for (const [at, input] of inputs.entries()) {
      input.value = values[at] || "";
      binding.set(parameters[at].name, input.value);
    }
    draw();
  }
  draw();
  const about = [
    exogenous && "exogenous: the agent does not execute the operator",
    waitsForSensing && "waits until sensed effects are observed",
  ];
  return el.div(
    note(about.filter(Boolean).join(" · ")),
    calls.length > 0 &&
      el(
        "p.tools",
        dim("in plans:"),
        calls.map(({ label, values }) => button(label, () => take(values))),
      ),
    el(
      "div.fields",
      parameters.map(({ name, type }, at) => field("?" + name + " - " + type, inputs[at])),
    ),
    el(
      "datalist#domain-values",
      domain.values.map((value) => el.option({ value })),
    ),
    body,
  );
}
