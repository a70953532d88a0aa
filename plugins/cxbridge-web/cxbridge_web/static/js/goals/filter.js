// Choices above the goals: outcome, class, robot. They stay when another view was open.
import { el } from "cx/dom.js";
import { goalOutcome, NAMES, OUTCOMES } from "cx/outcome.js";
import { robotsOf } from "cx/goals/numbers.js";

const chosen = { outcome: "", cls: "", robot: "" };

function choice(name, label, changed) {
  const select = el("select", { "aria-label": label, class: "filter" });
  let drawn = "";
  select.addEventListener("change", () => {
    chosen[name] = select.value;
    changed();
  });
  /** @param options pairs of value and text */
  select.offer = (options) => {
    const all = options.some(([value]) => value === chosen[name]) || !chosen[name];
    if (!all) chosen[name] = "";
    const sign = JSON.stringify([options, chosen[name]]);
    if (sign === drawn) return;
    drawn = sign;
    select.replaceChildren(
      ...[["", "any " + label], ...options].map(([value, text]) =>
        el("option", { value, selected: value === chosen[name] }, text),
      ),
    );
    select.classList.toggle("is-set", Boolean(chosen[name]));
  };
  return select;
}

export function goalFilter(app, changed) {
  const outcome = choice("outcome", "outcome", changed),
    cls = choice("cls", "class", changed),
    robot = choice("robot", "robot", changed);
  const robotsBelow = (goal) => robotsOf(app.model.actions.get(goal.key));
  return {
    nodes: [outcome, cls, robot],
    get isSet() {
      return Object.values(chosen).some(Boolean);
    },
    clear() {
      Object.assign(chosen, { outcome: "", cls: "", robot: "" });
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
      cls.hidden = classes.size < 2 && !chosen.cls;
    },
    fits: (goal) =>
      (!chosen.outcome || goalOutcome(goal) === chosen.outcome) &&
      (!chosen.cls || goal.cls === chosen.cls) &&
      (!chosen.robot || robotsBelow(goal).has(chosen.robot)),
  };
}
