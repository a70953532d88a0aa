// Facts as CLIPS prints them, taken apart: (template (slot value ...) ...), or (template value ...).
const TOKEN = /"(?:\\.|[^"\\])*"|[()]|[^\s()"]+/gs;

/**
 * @returns {template, slots: Map name -> text}; slots is null of a fact without; null when the text is cut
 * off
 */
export function parseFact(text) {
  const tokens = text.match(TOKEN) || [];
  if (tokens[0] !== "(" || tokens[tokens.length - 1] !== ")" || tokens.length < 3) return null;
  const template = tokens[1],
    slots = new Map();
  if (tokens[2] !== "(") return { template, slots: tokens.length === 3 ? new Map() : null };
  for (let at = 2; at < tokens.length - 1;) {
    if (tokens[at] !== "(" || at + 1 >= tokens.length - 1) return null;
    const name = tokens[at + 1],
      values = [];
    for (at += 2; tokens[at] !== ")"; at++) {
      if (at >= tokens.length - 1) return null;
      values.push(tokens[at]);
    }
    slots.set(name, values.join(" "));
    at += 1;
  }
  return { template, slots };
}

const unquote = (token) => (token.startsWith('"') ? token.slice(1, -1).replace(/\\(.)/gs, "$1") : token);
/** The values in the text of a slot: texts without quotes. */
export const valuesOf = (text) => ((text || "").match(TOKEN) || []).map(unquote);
const bare = (text) => (text === "nil" ? "" : text);
const first = (slots, name) => bare(valuesOf(slots.get(name))[0] || "");
const all = (slots, name) => valuesOf(slots.get(name));

function slotsOf(facts, template) {
  return facts
    .filter((fact) => fact.template === template)
    .map((fact) => parseFact(fact.text))
    .filter((each) => each && each.slots)
    .map((each) => each.slots);
}

/** Facts -> what the API tells of the executive's own environment. */
export const MODELS = {
  goals: {
    templates: ["goal", "plan"],
    make(facts) {
      const plans = slotsOf(facts, "plan");
      return slotsOf(facts, "goal").map((slots) => ({
        id: first(slots, "id"),
        class: first(slots, "class"),
        type: first(slots, "type"),
        "sub-type": first(slots, "sub-type"),
        parent: first(slots, "parent"),
        mode: first(slots, "mode"),
        outcome: first(slots, "outcome"),
        error: all(slots, "error"),
        message: first(slots, "message"),
        priority: first(slots, "priority"),
        parameters: all(slots, "params"),
        meta: all(slots, "meta"),
        "required-resources": all(slots, "required-resources"),
        "acquired-resources": all(slots, "acquired-resources"),
        plans: plans
          .filter((plan) => first(plan, "goal-id") === first(slots, "id"))
          .map((plan) => first(plan, "id")),
      }));
    },
  },
  plans: {
    templates: ["plan", "plan-action"],
    make(facts) {
      const actions = slotsOf(facts, "plan-action");
      return slotsOf(facts, "plan").map((plan) => ({
        id: first(plan, "id"),
        "goal-id": first(plan, "goal-id"),
        cost: Number(first(plan, "cost")) || 0,
        actions: actions
          .filter(
            (action) =>
              first(action, "goal-id") === first(plan, "goal-id") &&
              first(action, "plan-id") === first(plan, "id"),
          )
          .map((action) => ({
            id: Number(first(action, "id")),
            "operator-name": first(action, "action-name"),
            "param-values": all(action, "param-values"),
            state: first(action, "state"),
            executable: first(action, "executable") === "TRUE",
            duration: Number(first(action, "duration")) || 0,
          }))
          .sort((a, b) => a.id - b.id),
      }));
    },
  },
  "domain-facts": {
    templates: ["domain-fact"],
    make: (facts) =>
      slotsOf(facts, "domain-fact").map((slots) => ({
        name: first(slots, "name"),
        "param-values": all(slots, "param-values"),
      })),
  },
  "domain-objects": {
    templates: ["domain-object"],
    make: (facts) =>
      slotsOf(facts, "domain-object").map((slots) => ({
        name: first(slots, "name"),
        type: first(slots, "type"),
      })),
  },
  "domain-predicates": {
    templates: ["domain-predicate"],
    make: (facts) =>
      slotsOf(facts, "domain-predicate").map((slots) => ({
        name: first(slots, "name"),
        sensed: first(slots, "sensed") === "TRUE",
        "param-names": all(slots, "param-names"),
        "param-types": all(slots, "param-types"),
      })),
  },
  "domain-operators": {
    templates: ["domain-operator", "domain-operator-parameter"],
    make(facts) {
      const parameters = slotsOf(facts, "domain-operator-parameter");
      return slotsOf(facts, "domain-operator").map((slots) => ({
        name: first(slots, "name"),
        "wait-sensed": first(slots, "wait-sensed") !== "FALSE",
        parameters: parameters
          .filter((each) => first(each, "operator") === first(slots, "name"))
          .map((each) => ({ name: first(each, "name"), type: first(each, "type") })),
      }));
    },
  },
};
