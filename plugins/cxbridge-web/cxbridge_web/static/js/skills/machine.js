// The states of a skill, read from the graph in the dot language that its Skiller writes.
import { dataTable, el } from "cx/dom.js";

// A statement of the dot language: a name, perhaps an arrow and a second name, and attributes in brackets. A
// name is quoted or bare; each form has a group.
const QUOTED = '"((?:\\\\.|[^"\\\\])*)"',
  NAME = `(?:${QUOTED}|([\\w:.-]+))`,
  STATEMENT = new RegExp(
    `${NAME}\\s*(?:->\\s*${NAME}\\s*)?(?:\\[((?:"(?:\\\\.|[^"\\\\])*"|[^\\]"])*)\\])?`,
    "gs",
  ),
  ATTRIBUTE = new RegExp(`(\\w+)\\s*=\\s*${NAME}`, "gs"),
  DEFAULTS = ["graph", "node", "edge"]; // names that give default attributes, and are no states
// the colours of Fawkes' graphs: taken transitions, and the two ends
const TAKEN = "#ff8000",
  ICONS = { "#6fdd6f": "✓ ", "#ff8080": "✗ " };

/** A label without the escapes of the dot language; \n, \l and \r, which end a line there, become spaces. */
const plainText = (text) => text.replace(/\\([nlr])/g, " ").replace(/\\(.)/g, "$1");

/** @returns {Map<string, {label, icon, isActive, next: {to, label, isTaken}[]}>} the states by their names */
export function statesOf(graph) {
  const states = new Map(),
    stateOf = (name) => {
      if (!states.has(name))
        states.set(name, { label: plainText(name), icon: "", isActive: false, next: [] });
      return states.get(name);
    };
  for (const [, quoted, bare, quotedTo, bareTo, attributeText] of graph.matchAll(STATEMENT)) {
    const name = quoted ?? bare,
      to = quotedTo ?? bareTo,
      attributes = [...(attributeText ?? "").matchAll(ATTRIBUTE)],
      valueOf = ([, key, quotedValue, bareValue]) => [key, quotedValue ?? bareValue],
      { label, taillabel, color, active } = Object.fromEntries(attributes.map(valueOf));
    if (to !== undefined) {
      // Fawkes writes a tail label, the indices in its trace, only for transitions that were taken
      const text = [taillabel, label].filter(Boolean).map(plainText).join(": ");
      stateOf(name).next.push({ to, label: text, isTaken: Boolean(taillabel) || color === TAKEN });
      stateOf(to);
    } else if (attributeText !== undefined && !DEFAULTS.includes(name))
      Object.assign(stateOf(name), {
        ...{ label: plainText(label ?? name), icon: ICONS[color] ?? "", isActive: active === "true" },
      });
  }
  return states;
}

/** A row for each state, with its transitions. */
export function stateTable(states) {
  const transition = ({ to, label, isTaken }) =>
    el.div(isTaken ? { class: "taken" } : {}, label && label + " ", "→ ", states.get(to).label);
  const row = ({ label, icon, isActive, next }) =>
    el.tr(
      isActive ? { class: "active", "aria-current": "step" } : {},
      el.th({ scope: "row" }, isActive ? "▶ " : icon, label),
      el.td(next.map(transition)),
    );
  return dataTable({ class: "states" }, ["state", "transitions"], [...states.values()].map(row));
}
