// The states of a skill, of the graph that its Skiller writes in the dot language.
import { dataTable, el } from "cx/dom.js";

const QUOTED = '"((?:\\\\.|[^"\\\\])*)"',
  NAME = `(?:${QUOTED}|([\\w:.-]+))`,
  STATEMENT = new RegExp(
    `${NAME}\\s*(?:->\\s*${NAME}\\s*)?(?:\\[((?:"(?:\\\\.|[^"\\\\])*"|[^\\]"])*)\\])?`,
    "gs",
  ),
  ATTRIBUTE = new RegExp(`(\\w+)\\s*=\\s*${NAME}`, "gs"),
  DEFAULTS = ["graph", "node", "edge"];
// the colours of Fawkes' graphs: taken transitions, and the two ends
const TAKEN = "#ff8000",
  ICONS = { "#6fdd6f": "✓ ", "#ff8080": "✗ " };

const plain = (text) => text.replace(/\\([nlr])/g, " ").replace(/\\(.)/g, "$1");

/** @returns {Map<string, {label, icon, isActive, next: {to, label, isTaken}[]}>} the states by their names */
export function statesOf(graph) {
  const states = new Map(),
    state = (name) => {
      if (!states.has(name)) states.set(name, { label: plain(name), icon: "", isActive: false, next: [] });
      return states.get(name);
    };
  for (const [, quoted, bare, quotedTo, bareTo, text] of graph.matchAll(STATEMENT)) {
    const name = quoted ?? bare,
      to = quotedTo ?? bareTo,
      found = [...(text ?? "").matchAll(ATTRIBUTE)].map(([, key, long, short]) => [key, long ?? short]),
      { label, taillabel, color, active } = Object.fromEntries(found);
    if (to !== undefined) {
      const words = [taillabel, label].filter(Boolean).map(plain).join(": ");
      state(name).next.push({ to, label: words, isTaken: Boolean(taillabel) || color === TAKEN });
      state(to);
    } else if (text !== undefined && !DEFAULTS.includes(name))
      Object.assign(state(name), {
        ...{ label: plain(label ?? name), icon: ICONS[color] ?? "", isActive: active === "true" },
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
