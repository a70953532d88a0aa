// Parses facts as CLIPS prints them, (template (slot value ...) ...) or (template value ...), and makes the
// API's models of goals and plans from facts.
import { bare } from "cx/names.js";

// a string, a parenthesis, or a symbol or number
const TOKEN = /"(?:\\.|[^"\\])*"|[()]|[^\s()"]+/gs;

/**
 * Parse the text of a fact.
 * @returns {template, slots: Map name -> text}, with slots null for an ordered fact; null for a truncated
 * text
 */
export function parseFact(text) {
  const tokens = text.match(TOKEN) || [];
  if (tokens[0] !== "(" || tokens[tokens.length - 1] !== ")" || tokens.length < 3) return null;
  const template = tokens[1],
    slots = new Map();
  // an ordered fact; (template) alone is a fact without slots
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
/** The values in the text of a slot; strings without their quotes. */
export const valuesOf = (text) => ((text || "").match(TOKEN) || []).map(unquote);

/**
 * Return a function that finds the facts of a deftemplate. Of each fact, `first(name)` returns the first
 * value of a slot, and `all(name)` all its values.
 */
function makeFactFinder(facts) {
  const factsByTemplate = new Map();
  for (const { text } of facts) {
    const { template, slots } = parseFact(text) || {};
    if (!slots) continue;
    const all = (name) => valuesOf(slots.get(name)),
      first = (name) => bare(all(name)[0] || "");
    if (!factsByTemplate.has(template)) factsByTemplate.set(template, []);
    factsByTemplate.get(template).push({ all, first });
  }
  return (template) => factsByTemplate.get(template) || [];
}

const valuesByName = (names, get) => Object.fromEntries(names.map((name) => [name, get(name)]));
// the slots of a goal whose names the API keeps: with a single value, and with a list of values
const GOAL_SLOTS = ["id", "class", "type", "sub-type", "parent", "mode", "outcome", "message", "priority"],
  GOAL_LIST_SLOTS = ["error", "meta", "required-resources", "acquired-resources"];

function goalOf({ all, first }, plans) {
  const ownPlans = plans.filter((plan) => plan.first("goal-id") === first("id"));
  return {
    ...valuesByName(GOAL_SLOTS, first),
    ...valuesByName(GOAL_LIST_SLOTS, all),
    parameters: all("params"),
    plans: ownPlans.map((plan) => plan.first("id")),
  };
}
const actionOf = ({ all, first }) => ({
  id: Number(first("id")),
  "operator-name": first("action-name"),
  "param-values": all("param-values"),
  state: first("state"),
  executable: first("executable") === "TRUE",
  duration: Number(first("duration")) || 0,
});
function planOf({ first }, actions) {
  const isOf = (action) =>
    action.first("goal-id") === first("goal-id") && action.first("plan-id") === first("id");
  return {
    ...valuesByName(["id", "goal-id"], first),
    cost: Number(first("cost")) || 0,
    actions: actions
      .filter(isOf)
      .map(actionOf)
      .sort((a, b) => a.id - b.id),
  };
}

/**
 * The maker of a list of the API, and the deftemplates that it needs.
 * @param templates the deftemplate of the listed facts, and the deftemplate of their parts
 * @param itemOf(fact, parts) makes an item of the list; for the facts see makeFactFinder()
 * @returns {templates, make(facts)}, where `make` returns the list
 */
function modelOf(templates, itemOf) {
  const make = (facts) => {
    const [listed, parts = []] = templates.map(makeFactFinder(facts));
    return listed.map((fact) => itemOf(fact, parts));
  };
  return { templates, make };
}
/** Makers of the API's lists from facts: the API has these lists only for the executive's environment. */
export const MODELS = {
  goals: modelOf(["goal", "plan"], goalOf),
  plans: modelOf(["plan", "plan-action"], planOf),
};
