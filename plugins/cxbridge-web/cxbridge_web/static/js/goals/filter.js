// Choices above the goals: words, outcome, class, robot. The address has them, and they stay when another view was open.
import { el, search } from "cx/dom.js";
import { goalText } from "cx/looks.js";
import { goalOutcome, NAMES, OUTCOMES } from "cx/outcome.js";
import { parseAddress } from "cx/selection.js";
import { robotsOf } from "cx/goals/numbers.js";

const NOTHING = { words: "", outcome: "", class: "", robot: "" },
  FILTERS = Object.keys(NOTHING);
const chosen = { ...NOTHING };

/** The choices as the query of an address. */
export function filterQuery(more = {}) {
  const set = FILTERS.filter((name) => chosen[name]).map((name) => [name, chosen[name]]);
  const text = new URLSearchParams([...Object.entries(more), ...set]).toString();
  return text ? "?" + text : "";
}

function write() {
  const { path, query } = parseAddress(location.hash);
  for (const name of FILTERS)
    if (chosen[name]) query.set(name, chosen[name]);
    else query.delete(name);
  const text = query.toString();
  history.replaceState(history.state, "", path + (text ? "?" + text : ""));
}

function choice(name, changed) {
  const select = el("select.filter", { "aria-label": name });
  let drawn = "";
  select.addEventListener("change", () => {
    chosen[name] = select.value;
    write();
    changed();
  });
  /** @param options pairs of value and text */
  select.offer = (options) => {
    const all =
        chosen[name] && !options.some(([value]) => value === chosen[name])
          ? [...options, [chosen[name], chosen[name]]]
          : options,
      sign = JSON.stringify([all, chosen[name]]);
    if (sign === drawn) return;
    drawn = sign;
    select.replaceChildren(
      ...[["", "any " + name], ...all].map(([value, text]) =>
        el.option({ value, selected: value === chosen[name] }, text),
      ),
    );
    select.classList.toggle("is-set", Boolean(chosen[name]));
  };
  return select;
}

export function goalFilter(app, changed) {
  const find = search("Search goals", (text) => {
    chosen.words = text;
    write();
    changed();
  });
  const outcome = choice("outcome", changed),
    cls = choice("class", changed),
    robot = choice("robot", changed);
  const robotsBelow = (goal) => robotsOf(app.model.actions.get(goal.key));
  return {
    nodes: [find, outcome, cls, robot],
    get isSet() {
      return FILTERS.some((name) => chosen[name]);
    },
    clear() {
      Object.assign(chosen, NOTHING);
      find.value = "";
      write();
    },
    /** Take over what the address says; what it does not say stays, and is written there. */
    read() {
      const { query } = parseAddress(location.hash);
      if (FILTERS.some((name) => query.has(name)))
        for (const name of FILTERS) chosen[name] = query.get(name) || "";
      if (document.activeElement !== find) find.value = chosen.words;
      write();
    },
    /** Offer what there is among these goals. */
    offer(goals) {
      const classes = new Set(),
        robots = new Set();
      for (const goal of goals) {
        if (goal.cls) classes.add(goal.cls);
        for (const each of robotsBelow(goal)) robots.add(each);
      }
      outcome.offer(NAMES.map((name) => [name, OUTCOMES[name].word]));
      cls.offer([...classes].sort().map((name) => [name, name]));
      robot.offer([...robots].sort().map((name) => [name, name]));
      robot.hidden = robots.size < 2 && !chosen.robot;
      cls.hidden = classes.size < 2 && !chosen.class;
    },
    fits: (goal) =>
      (!chosen.outcome || goalOutcome(goal) === chosen.outcome) &&
      (!chosen.class || goal.cls === chosen.class) &&
      (!chosen.robot || robotsBelow(goal).has(chosen.robot)) &&
      (!chosen.words ||
        [goal.id, goal.cls, goalText(goal), goal.error, goal.subType]
          .join(" ")
          .toLowerCase()
          .includes(chosen.words)),
  };
}
