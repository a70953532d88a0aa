// The operators of a domain: parameters, precondition and effects, made of the facts of the executive.
import { parseFact, valuesOf } from "cx/clips/text.js";

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

/** @param texts of facts, any deftemplates */
export function readDomain(texts) {
  const of = new Map(TEMPLATES.map((template) => [template, []]));
  for (const text of new Set(texts)) {
    const fact = parseFact(text);
    if (fact && fact.slots && of.has(fact.template)) of.get(fact.template).push(fact.slots);
  }
  const one = (slots, name) => valuesOf(slots.get(name))[0] || "",
    many = (slots, name) => valuesOf(slots.get(name));
  const partsOf = (template, whole) => of.get(template).filter((slots) => one(slots, "part-of") === whole);

  function formulas(whole, depth = 0) {
    if (depth > 30) return [];
    const inner = partsOf("pddl-formula", whole).flatMap((slots) => {
      const children = formulas(one(slots, "id"), depth + 1),
        type = one(slots, "type");
      return type === "atom" ? children : [{ type, children }];
    });
    const atoms = partsOf("pddl-predicate", whole).map((slots) => ({
      type: "atom",
      name: one(slots, "predicate"),
      names: many(slots, "param-names"),
      constants: many(slots, "param-constants"),
    }));
    return [...inner, ...atoms];
  }
  const conditionOf = (whole) => {
    const found = formulas(whole);
    return found.length > 1 ? { type: "conjunction", children: found } : found[0] || null;
  };
  const operators = of.get("domain-operator").map((slots) => {
    const name = one(slots, "name"),
      types = new Map(
        of
          .get("domain-operator-parameter")
          .filter((each) => one(each, "operator") === name)
          .map((each) => [one(each, "name"), one(each, "type")]),
      );
    return {
      name,
      waitsForSensing: one(slots, "wait-sensed") !== "FALSE",
      exogenous: one(slots, "exogenous") === "TRUE",
      parameters: many(slots, "param-names").map((each) => ({
        name: each,
        type: types.get(each) || "object",
      })),
      precondition: conditionOf(name),
      effects: partsOf("domain-effect", name).map((effect) => ({
        positive: one(effect, "type") !== "NEGATIVE",
        atom: {
          type: "atom",
          name: one(effect, "predicate"),
          names: many(effect, "param-names"),
          constants: many(effect, "param-constants"),
        },
        condition: conditionOf(one(effect, "name")),
      })),
    };
  });
  const facts = of.get("domain-fact").map((slots) => [one(slots, "name"), ...many(slots, "param-values")]);
  const objects = of
    .get("domain-object")
    .map((slots) => ({ name: one(slots, "name"), type: one(slots, "type") }));
  return {
    operators: operators.sort((a, b) => (a.name < b.name ? -1 : 1)),
    facts: new Set(facts.map((words) => words.join(" "))),
    /** Objects, and what facts are about (constants are no objects). */
    values: [
      ...new Set([...objects.map((each) => each.name), ...facts.flatMap((words) => words.slice(1))]),
    ].sort(),
  };
}
