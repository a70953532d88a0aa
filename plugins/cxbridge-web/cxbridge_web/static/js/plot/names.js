// What can be plotted, by name: `Type::id.field[2]`, `env:template{slot=value}.slot[1]`, `loop`.
import { parseFact, valuesOf } from "cx/clips/text.js";

const FIELD = /^([A-Za-z_]\w*)::(.+)\.([A-Za-z_]\w*)(?:\[(\d+)\])?$/s;
const SLOT = /^(?:([^\s:{}]+):)?([^\s:{}.]+)(?:\{([^{}]*)\})?\.([^\s.[\]]+)(?:\[(\d+)\])?$/;
const LOOP = /^loop(?: time)?$/;
const MOST_ELEMENTS = 8;
export const HINT = "Type::id.field, template.slot, template{slot=value}.slot, or loop";

const element = (value, index) => (Array.isArray(value) ? value[index ?? 0] : value);
const ending = (index) => (index === undefined ? "" : "[" + index + "]");

function ofField([, type, id, field, index]) {
  const uid = type + "::" + id,
    at = index === undefined ? undefined : Number(index);
  return {
    name: uid + "." + field + ending(at),
    label: field + ending(at),
    about: uid,
    kind: "interface",
    axis: type + "." + field,
    isStep: false,
    uid,
    type,
    id,
    sample: (event) =>
      event.kind === "interface" && event.uid === uid && field in event.values
        ? element(event.values[field], at)
        : undefined,
  };
}

function conditions(text) {
  const found = [];
  for (const part of (text || "").split(",")) {
    const at = part.indexOf("=");
    if (at > 0) found.push([part.slice(0, at).trim(), part.slice(at + 1).trim()]);
    else if (part.trim()) return null;
  }
  return found;
}

function ofSlot([, env, template, where, slot, index], usualEnv) {
  const wanted = conditions(where),
    of = env || usualEnv,
    at = index === undefined ? 0 : Number(index);
  if (wanted === null) return null;
  const filter = wanted.length ? "{" + wanted.map((pair) => pair.join("=")).join(",") + "}" : "";
  return {
    name: of + ":" + template + filter + "." + slot + ending(index),
    label: slot + ending(index),
    about: template + filter + " (" + of + ")",
    kind: "fact",
    axis: template + "." + slot,
    isStep: true,
    env: of,
    template,
    sample(event) {
      if (event.kind !== "fact" || !event.asserted || event.template !== template || event.env !== of)
        return undefined;
      const fact = parseFact(event.text);
      if (!fact || !fact.slots || !fact.slots.has(slot)) return undefined;
      for (const [name, value] of wanted)
        if (valuesOf(fact.slots.get(name)).join(" ") !== value) return undefined;
      return valuesOf(fact.slots.get(slot))[at];
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
 * @param usualEnv environment of facts whose name has none
 * @returns what the name stands for: name (in full), label, about, kind, axis, sample(event) -> value or
 * undefined; null: it is none
 */
export function parseName(text, usualEnv) {
  const name = text.trim();
  if (LOOP.test(name)) return LOOP_TIME;
  const field = FIELD.exec(name);
  if (field) return ofField(field);
  const slot = SLOT.exec(name);
  return slot ? ofSlot(slot, usualEnv) : null;
}

/** The names of a field: one, or those of its elements. */
export function fieldNames(uid, field, value) {
  if (!Array.isArray(value)) return [uid + "." + field];
  return value.slice(0, MOST_ELEMENTS).map((_, at) => uid + "." + field + "[" + at + "]");
}
