// Names of plotted values, as users type them and addresses have them: `Type::id.field[2]`,
// `env:template{slot=value}.slot[1]`, `loop`.
import { parseFact, valuesOf } from "cx/clips/text.js";

// groups: type, id, field, index
const FIELD = /^([A-Za-z_]\w*)::(.+)\.([A-Za-z_]\w*)(?:\[(\d+)\])?$/s;
// groups: environment, template, conditions, slot, index
const SLOT = /^(?:([^\s:{}]+):)?([^\s:{}.]+)(?:\{([^{}]*)\})?\.([^\s.[\]]+)(?:\[(\d+)\])?$/;
const LOOP = /^loop(?: time)?$/;
const MOST_ELEMENTS = 8; // of an array, in proposals
export const HINT = "Type::id.field, template.slot, template{slot=value}.slot, or loop";

/** The end of a name for an element of an array or multislot; "" without an index. */
const indexText = (index) => (index === undefined ? "" : "[" + index + "]");

function fieldSource([, type, id, field, index]) {
  const uid = type + "::" + id,
    label = field + indexText(index);
  return {
    name: uid + "." + label,
    label,
    about: uid,
    kind: "interface",
    axis: type + "." + field,
    isStep: false,
    uid,
    type,
    id,
    sample(event) {
      const value = event.kind === "interface" && event.uid === uid ? event.values[field] : undefined;
      return Array.isArray(value) ? value[index ?? 0] : value;
    },
  };
}

/** Pairs of slots and wanted values; null: the text is no list of conditions. */
function conditions(text = "") {
  const parts = text.split(",").filter((part) => part.trim()),
    pairs = parts.map((part) => /^([^=]+)=(.*)$/s.exec(part));
  return pairs.includes(null) ? null : pairs.map(([, slot, value]) => [slot.trim(), value.trim()]);
}

function slotSource([, givenEnv, template, conditionText, slot, index], usualEnv) {
  const wanted = conditions(conditionText),
    env = givenEnv || usualEnv;
  if (wanted === null) return null;
  const filter = wanted.length ? "{" + wanted.map((pair) => pair.join("=")).join(",") + "}" : "",
    label = slot + indexText(index);
  return {
    name: env + ":" + template + filter + "." + label,
    label,
    about: template + filter + " (" + env + ")",
    kind: "fact",
    axis: template + "." + slot,
    isStep: true,
    env,
    template,
    sample(event) {
      if (event.kind !== "fact" || !event.asserted || event.template !== template || event.env !== env)
        return undefined;
      const slots = parseFact(event.text)?.slots,
        fits = ([name, value]) => valuesOf(slots.get(name)).join(" ") === value;
      return slots?.has(slot) && wanted.every(fits) ? valuesOf(slots.get(slot))[index ?? 0] : undefined;
    },
  };
}

const LOOP_TIME = {
  name: "loop",
  label: "loop time, ms",
  about: "main loop",
  kind: "loop",
  axis: "ms",
  isStep: false,
  sample: (event) => (event.kind === "loop" ? event.duration_us / 1000 : undefined),
};

/**
 * Return the source of a series by its name; null for a text that is not a name.
 * @param usualEnv the environment for a name without an environment
 * @returns {object} the source:
 *   name: the full name;
 *   label: the last part of the name, or a description, for the legend;
 *   about: the interface, the template with its environment, or the main loop, for the legend;
 *   kind: the kind of its events;
 *   axis: series with the same axis share one in the plot;
 *   isStep: whether a value holds until the next value;
 *   sample(event): the value in an event, or undefined;
 *   uid, type, id (an interface only) and env, template (a fact only): where the present value is read
 */
export function findSource(text, usualEnv) {
  const name = text.trim(),
    field = FIELD.exec(name),
    slot = SLOT.exec(name);
  if (LOOP.test(name)) return LOOP_TIME;
  if (field) return fieldSource(field);
  return slot && slotSource(slot, usualEnv);
}

/** A list of the name of a field, or of the names of an array's first MOST_ELEMENTS elements. */
export function fieldNames(uid, field, value) {
  const name = uid + "." + field;
  if (!Array.isArray(value)) return [name];
  return value.slice(0, MOST_ELEMENTS).map((_, at) => name + "[" + at + "]");
}
