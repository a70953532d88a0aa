// The operators of a domain: parameters, precondition and effects, made of the facts of the executive.
import { slotsBy } from "cx/clips/text.js";

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

/** @param facts of any deftemplates */
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
