// Rows of the timeline: robots, then the trees of goals with their plan-actions; folds and filters.
import { forestOfGoals } from "cx/forest.js";
import { NAMES } from "cx/outcome.js";
import { outcomeAt, spansOf } from "cx/timeline/spans.js";

/**
 * @typedef {object} Row
 * @property {string} key
 * @property {"group" | "robot" | "goal" | "action"} kind
 * @property {object} item the goal or action; the calls of a robot
 * @property {number} depth
 * @property {boolean | null} open null: nothing is below it
 * @property {boolean} isSummary a goal whose parts have rows; else the actions are within the bar of the goal
 */

/** What is shown of a history: which rows are folded, which outcomes and words are wanted. */
export class Rows {
  constructor(history) {
    this.history = history;
    this.folds = new Map(); // key -> open or not, where a user said so
    this.wanted = "";
    this.outcomes = new Set(); // empty: all
    this.inSight = null; // a TimeWindow: only rows with a bar in it
    this.env = "";
    this.opensAll = null; // whether all is open; null: what has sub-goals
  }

  isOpen(key, usual) {
    return this.folds.has(key) ? this.folds.get(key) : usual;
  }
  foldAll(open) {
    this.folds.clear();
    this.opensAll = open;
  }
  get filters() {
    return this.wanted !== "" || this.outcomes.size > 0 || this.inSight !== null;
  }

  get goals() {
    const all = [...this.history.goals.values()];
    return this.env ? all.filter((goal) => goal.env === this.env) : all;
  }

  /** How many goals there are of each outcome. */
  counts() {
    const counts = Object.fromEntries(NAMES.map((name) => [name, 0]));
    for (const goal of this.goals) counts[outcomeAt(goal)] += 1;
    return counts;
  }

  fits(item) {
    if (this.outcomes.size && !this.outcomes.has(outcomeAt(item))) return false;
    if (this.wanted) {
      const text = [item.id, item.cls, item.name, item.subType, item.env].join(" ").toLowerCase();
      const { error = "" } = item.changes.at(-1);
      if (!text.includes(this.wanted) && !error.toLowerCase().includes(this.wanted)) return false;
    }
    if (!this.inSight) return true;
    const spans = spansOf(item, this.history).filter(({ part }) => part !== "tail"),
      { axis, from, to } = this.inSight;
    return (
      spans.length > 0 && spans[0].from[axis] <= to && (!spans.at(-1).to || spans.at(-1).to[axis] >= from)
    );
  }

  robots() {
    const lanes = new Map();
    for (const call of this.history.calls) {
      if (!lanes.has(call.lane)) lanes.set(call.lane, []);
      lanes.get(call.lane).push(call);
    }
    const rows = [...lanes].sort(([a], [b]) => (a < b ? -1 : 1)),
      names = rows.map(([, [{ skiller }]]) => skiller),
      isTwice = (name) => names.indexOf(name) !== names.lastIndexOf(name);
    return rows.map(([lane, calls], at) => ({
      key: "robot " + lane,
      kind: "robot",
      name: isTwice(names[at]) ? lane : names[at],
      item: calls,
    }));
  }
  planners() {
    const { planners } = this.history;
    return planners.length ? [{ key: "planners", kind: "robot", name: "planners", item: planners }] : [];
  }

  /** @returns {Row[]} what is shown, in order */
  list() {
    const rows = [],
      group = (key, name, lanes) => {
        if (!lanes.length) return;
        const open = this.isOpen(key, true);
        rows.push({ key, kind: "group", name, item: lanes, depth: 0, open });
        if (open) for (const lane of lanes) rows.push({ ...lane, depth: 1, open: null });
      };
    group("robots", this.history.calls === this.history.ofBoard ? "Executors" : "Robots", this.robots());
    group("planning", "Planning", this.planners());
    this.addGoals(rows);
    return rows;
  }

  addGoals(rows) {
    const { goals, filters } = this,
      { parents, children, roots } = forestOfGoals(goals);
    // with a filter, those that fit stand with the goals above them
    const shown = filters ? this.withAncestors(goals, parents) : null;
    const envs = new Set(goals.map(({ env }) => env)).size > 1;
    const stack = roots.reverse().map((goal) => [goal, 0]);
    let env = null;
    if (envs) stack.sort(([a], [b]) => (a.env < b.env ? 1 : a.env > b.env ? -1 : 0));
    while (stack.length) {
      const [item, depth] = stack.pop();
      if (envs && item.kind === "goal" && !depth && item.env !== env) {
        ({ env } = item);
        rows.push({ key: "env " + env, kind: "group", name: env, item: [], depth: 0, open: null });
      }
      const below = item.kind === "goal" ? [...(children.get(item.key) || []), ...item.actions] : [];
      const seen = shown ? below.filter((each) => shown.has(each.key)) : below;
      const usual = filters || (this.opensAll ?? seen.some(({ kind }) => kind === "goal"));
      const open = seen.length ? this.isOpen(item.key, usual) : null;
      if (shown && !shown.has(item.key)) continue;
      const isSummary = open === true || below.some(({ kind }) => kind === "goal");
      rows.push({ key: item.key, kind: item.kind, name: item.id, item, depth, open, isSummary });
      if (open) for (let at = seen.length - 1; at >= 0; at--) stack.push([seen[at], depth + 1]);
    }
  }

  withAncestors(goals, parents) {
    const shown = new Set(),
      add = (key) => {
        for (let at = key; at && !shown.has(at); at = parents.get(at)) shown.add(at);
      };
    for (const goal of goals) {
      if (this.fits(goal)) add(goal.key);
      for (const action of this.wanted ? goal.actions : []) {
        if (!this.fits(action)) continue;
        shown.add(action.key);
        add(goal.key);
      }
    }
    return shown;
  }

  /** Open what is above a goal, so that it has a row. */
  reveal(item) {
    let goal = this.history.goals.get(item.parent);
    for (let levels = 0; goal && levels < 1000; levels++) {
      if (!this.isOpen(goal.key, false)) this.folds.set(goal.key, true);
      goal = this.history.goals.get(goal.parent);
    }
  }
}
