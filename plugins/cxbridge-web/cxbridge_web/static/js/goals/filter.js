// Filters above the goals: words, outcome, class, robot. The address has the filters, which stay while other
// views are open.
import { choice, search } from "cx/dom.js";
import { robotsOf } from "cx/goals/numbers.js";
import { goalOutcome, goalText, OUTCOME_NAMES, OUTCOMES } from "cx/outcome.js";
import { parseAddress } from "cx/selection.js";

const NOTHING = { words: "", outcome: "", class: "", robot: "" },
  FILTERS = Object.keys(NOTHING);
const chosen = { ...NOTHING };

/**
 * The filters as the query of an address, behind `?`; "" without filters.
 * @param more further names and values
 */
export function filterQuery(more = {}) {
  const set = FILTERS.filter((name) => chosen[name]).map((name) => [name, chosen[name]]),
    text = new URLSearchParams([...Object.entries(more), ...set]).toString();
  return text && "?" + text;
}

/** Write the filters into the address, without a step in the browser's history. */
function write() {
  const { path, query } = parseAddress(location.hash);
  for (const name of FILTERS)
    if (chosen[name]) query.set(name, chosen[name]);
    else query.delete(name);
  const text = query.toString();
  history.replaceState(history.state, "", path + (text && "?" + text));
}

/**
 * Make the filters of the goals.
 * @param changed called when the user changes a filter
 * @returns {nodes, isSet, clear, read, offer, fits}: `nodes` are the controls; `isSet` tells whether a filter
 * is set, `fits(goal)` whether all filters let a goal through
 */
export function goalFilter(app, changed) {
  const choose = (name) => (value) => {
    chosen[name] = value;
    write();
    changed();
  };
  const find = search("Search goals", choose("words")),
    selects = ["outcome", "class", "robot"].map((name) =>
      choice({ "aria-label": name, class: "filter" }, choose(name)),
    ),
    robotsBelow = (goal) => robotsOf(app.model, goal);
  return {
    nodes: [find, selects],
    get isSet() {
      return FILTERS.some((name) => chosen[name]);
    },
    clear() {
      Object.assign(chosen, NOTHING);
      find.value = "";
      write();
    },
    /** Read the filters from the address; an address without filters gets the present filters. */
    read() {
      const { query } = parseAddress(location.hash);
      if (FILTERS.some((name) => query.has(name)))
        for (const name of FILTERS) chosen[name] = query.get(name) || "";
      if (document.activeElement !== find) find.value = chosen.words;
      write();
    },
    /** Offer the outcomes, classes and robots of these goals; a choice of one option is hidden. */
    offer(goals) {
      const optionLists = [
        OUTCOME_NAMES.map((name) => [name, OUTCOMES[name].word]),
        [...new Set(goals.map((goal) => goal.cls).filter(Boolean))].sort(),
        [...new Set(goals.flatMap((goal) => [...robotsBelow(goal)]))].sort(),
      ];
      for (const [at, select] of selects.entries()) {
        const name = FILTERS[at + 1], // behind the words
          value = chosen[name],
          isOffered = !value || optionLists[at].some((option) => [option].flat()[0] === value);
        select.offer([["", "any " + name], ...optionLists[at], ...(isOffered ? [] : [value])], value);
        select.classList.toggle("is-set", Boolean(value));
        select.hidden = optionLists[at].length < 2 && !value;
      }
    },
    fits: (goal) =>
      (!chosen.outcome || goalOutcome(goal) === chosen.outcome) &&
      (!chosen.class || goal.cls === chosen.class) &&
      (!chosen.robot || robotsBelow(goal).has(chosen.robot)) &&
      [goal.id, goal.cls, goalText(goal), goal.error, goal.subType]
        .join(" ")
        .toLowerCase()
        .includes(chosen.words),
  };
}
