// The rows of the timeline: robots, planners, then the trees of goals with their plan-actions; folds and
// filters; the names of rows, also for screen readers.
import { dim, durationText, el } from "cx/dom.js";
import { forestOfGoals } from "cx/forest.js";
import { OUTCOME_NAMES, OUTCOMES } from "cx/outcome.js";
import { nameOfLane } from "cx/timeline/board.js";
import { outcomeAt, spansOf, timesOf } from "cx/timeline/spans.js";

const rowsByHistory = new WeakMap(); // history -> its Rows, whose folds outlive the view

/** The names of robots by their lanes; robots with equal names have their lanes as names. */
export function robotNames(lanes) {
  const names = new Map([...lanes].map(([lane, [call]]) => [lane, call?.skiller ?? nameOfLane(lane)])),
    all = [...names.values()],
    isAmbiguous = (name) => all.indexOf(name) !== all.lastIndexOf(name);
  for (const [lane, name] of names) if (isAmbiguous(name)) names.set(lane, lane);
  return names;
}

/**
 * @typedef {object} Row
 * @property {string} key
 * @property {"group" | "robot" | "goal" | "action"} kind
 * @property {string} name
 * @property {object} item the goal or action; the calls of a robot or of the planners;
 *   the rows in a group of these; [] for an environment
 * @property {number} depth
 * @property {boolean | null} open null: a row without rows below it
 * @property {boolean} isSummary whether the goal is drawn as a line, because its parts have rows or it has
 *   sub-goals; else its bar contains its actions
 */

/** The rows of a history: folds, and filters by outcome, words and time. */
export class Rows {
  constructor(history) {
    this.history = history;
    this.folds = new Map(); // key -> whether the user has opened the row, or closed it
    this.searchText = ""; // in lower case; empty: no search
    this.outcomes = new Set(); // empty: all
    this.visibleWindow = null; // a TimeWindow: only goals with a bar in the window
    this.env = ""; // the environment of the shown goals; empty: all
    this.opensAll = null; // whether all goals are open; null: those with sub-goals, and with filters all
  }
  /** The rows of a history without filters, with the folds of the last view. */
  static of(history) {
    const { folds = new Map(), opensAll = null } = rowsByHistory.get(history) || {},
      rows = Object.assign(new Rows(history), { folds, opensAll });
    rowsByHistory.set(history, rows);
    return rows;
  }

  /** Whether a row is open: as the user folded it, else `usual`. */
  isOpen(key, usual) {
    return this.folds.get(key) ?? usual;
  }
  foldAll(open) {
    this.folds.clear();
    this.opensAll = open;
  }
  /** Whether a filter is set. */
  get hasFilters() {
    return this.searchText !== "" || this.outcomes.size > 0 || this.visibleWindow !== null;
  }

  get goals() {
    const all = [...this.history.goals.values()];
    return this.env ? all.filter((goal) => goal.env === this.env) : all;
  }

  /** The number of goals of each outcome. */
  counts() {
    const counts = Object.fromEntries(OUTCOME_NAMES.map((name) => [name, 0]));
    for (const goal of this.goals) counts[outcomeAt(goal)] += 1;
    return counts;
  }

  /** Whether a goal or an action meets the filters. */
  fits(item) {
    const { error = "" } = item.changes.at(-1),
      words = [item.id, item.cls, item.name, item.subType, item.env, error].join(" ").toLowerCase();
    if (this.outcomes.size && !this.outcomes.has(outcomeAt(item))) return false;
    if (!words.includes(this.searchText)) return false;
    if (!this.visibleWindow) return true;
    const spans = spansOf(item, this.history).filter(({ part }) => part !== "tail"),
      { axis, from, to } = this.visibleWindow,
      end = spans.at(-1)?.to;
    return spans.length > 0 && spans[0].from[axis] <= to && (!end || end[axis] >= from);
  }

  robotRows() {
    const lanes = [...this.history.lanes].sort(([a], [b]) => (a < b ? -1 : 1)),
      names = robotNames(lanes);
    return lanes.map(([lane, item]) => ({
      key: "robot " + lane,
      kind: "robot",
      name: names.get(lane),
      item,
    }));
  }
  /** The row of all planners' calls, in a list; [] without calls. */
  planningRows() {
    const { planners } = this.history;
    return planners.length ? [{ key: "planners", kind: "robot", name: "planners", item: planners }] : [];
  }

  /** All rows, from top to bottom. @returns {Row[]} */
  list() {
    const group = (key, name, lanes) => {
      const open = this.isOpen(key, true),
        laneRows = open ? lanes.map((lane) => ({ ...lane, depth: 1, open: null })) : [];
      return lanes.length ? [{ key, kind: "group", name, item: lanes, depth: 0, open }, ...laneRows] : [];
    };
    const { calls, boardCalls } = this.history,
      isBoard = calls === boardCalls && boardCalls.length > 0;
    return [
      ...group("robots", isBoard ? "Executors" : "Robots", this.robotRows()),
      ...group("planning", "Planning", this.planningRows()),
      ...this.goalRows(),
    ];
  }

  /** The rows of the goals' trees, each goal before its parts; several environments have headings. */
  goalRows() {
    const rows = [],
      { goals, hasFilters } = this,
      { parents, children, roots } = forestOfGoals(goals),
      // a filter keeps the goals above a match
      shown = hasFilters ? this.withAncestors(goals, parents) : null,
      hasSeveralEnvs = new Set(goals.map(({ env }) => env)).size > 1;
    const stack = [...roots].reverse().map((goal) => [goal, 0]);
    let env = null;
    // descending, because the last goal of the stack comes first
    if (hasSeveralEnvs) stack.sort(([a], [b]) => (a.env < b.env ? 1 : a.env > b.env ? -1 : 0));
    while (stack.length) {
      const [item, depth] = stack.pop(),
        isGoal = item.kind === "goal",
        parts = isGoal ? [...(children.get(item.key) || []), ...item.actions] : [],
        shownParts = shown ? parts.filter(({ key }) => shown.has(key)) : parts,
        hasGoals = (list) => list.some(({ kind }) => kind === "goal"),
        usual = hasFilters || (this.opensAll ?? hasGoals(shownParts)),
        open = shownParts.length ? this.isOpen(item.key, usual) : null;
      if (shown && !shown.has(item.key)) continue;
      if (hasSeveralEnvs && isGoal && !depth && item.env !== env) {
        ({ env } = item);
        rows.push({ key: "env " + env, kind: "group", name: env, item: [], depth: 0, open: null });
      }
      const isSummary = open === true || hasGoals(parts);
      rows.push({ key: item.key, kind: item.kind, name: item.id, item, depth, open, isSummary });
      if (open) stack.push(...shownParts.map((part) => [part, depth + 1]).reverse());
    }
    return rows;
  }

  /** The keys of goals and actions that meet the filters, and of the goals above them. */
  withAncestors(goals, parents) {
    const shown = new Set(),
      add = (key) => {
        for (let at = key; at && !shown.has(at); at = parents.get(at)) shown.add(at);
      };
    for (const goal of goals) {
      // only a search lists actions: the other filters are for goals
      const actions = this.searchText ? goal.actions.filter((action) => this.fits(action)) : [];
      for (const { key } of actions) shown.add(key);
      if (actions.length || this.fits(goal)) add(goal.key);
    }
    return shown;
  }

  /** Open the goals above a goal, so that it has a row. */
  reveal(item) {
    let goal = this.history.goals.get(item.parent);
    // limited, because goals of a damaged recording may be each other's parents
    for (let level = 0; goal && level < 1000; level++) {
      if (!this.isOpen(goal.key, false)) this.folds.set(goal.key, true);
      goal = this.history.goals.get(goal.parent);
    }
  }
}

const SHORT_NAME = 14, // characters: a name of at most this length fits into its column, and is not divided
  NAME_TAIL = 6; // characters at the end of a longer name that stay visible: they tell goals of a class apart
const isGoalOrAction = ({ kind }) => kind === "goal" || kind === "action";

/** Identifies the look of a row, which is drawn again when this value changes. @param step the moment */
export function signOf(row, step) {
  if (!isGoalOrAction(row)) return row.depth + " " + row.open + " " + row.item.length;
  const { changes, cls } = row.item;
  return [row.depth, row.open, outcomeAt(row.item, step), changes.length, cls].join("|");
}

function goalName({ id, cls }) {
  const isLong = id.length > SHORT_NAME;
  return [
    isLong && el.span(id.slice(0, -NAME_TAIL)),
    el.span(isLong ? id.slice(-NAME_TAIL) : id),
    cls && !id.includes(cls) && dim(" " + cls),
  ];
}

/** The nodes with the name of a row. */
export function nameOf(row, history, step) {
  const { item, kind } = row;
  if (!isGoalOrAction(row))
    return el("span.main-text", el.b(row.name), kind === "robot" && dim(" " + item.length));
  const outcome = outcomeAt(item, step),
    title = item.id + " " + (item.cls || item.name || ""),
    tone = outcome === "completed" || !outcome ? " dim" : " o-" + outcome,
    text = kind === "goal" ? goalName(item) : [dim(item.id + " "), item.text];
  return [
    el.i({ class: "tl-icon" + tone, "aria-hidden": "true" }, outcome ? OUTCOMES[outcome].icon : ""),
    el.span({ class: "main-text" + (outcome ? "" : " dim"), "aria-hidden": "true", title }, text),
    el("span.hear-only", spokenName(row, history, outcome)),
  ];
}

/** The name of a row for screen readers. */
function spokenName({ kind, item }, history, outcome) {
  const { ran } = timesOf(item, history),
    parts = [
      kind === "goal" ? "goal " + item.id : "action " + item.id + " " + item.text,
      outcome ? OUTCOMES[outcome].word : "not formulated yet",
      ran === null ? "" : "ran " + durationText(ran),
      kind === "goal" ? item.changes.at(-1).error : "",
    ];
  return parts.filter(Boolean).join(", ");
}
