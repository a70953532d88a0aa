// The run as a whole, beside the tree while no goal is chosen: its outcome, counts, the way to what failed.
import { part } from "cx/api.js";
import { clockText, durationText, el, none, pairs, wideTable } from "cx/dom.js";

import {
  goalOutcome,
  isOpen,
  NAMES,
  OUTCOMES,
  outcomeBadge,
  skillOutcome,
  actionOutcome,
} from "cx/outcome.js";
import { failures, wayToFailure } from "cx/goals/failure.js";
import { childrenOf } from "cx/goals/tree.js";
import { durationOf } from "cx/goals/numbers.js";

const MOST = 8;
const goalLink = (goal) => el("a", { href: "#/goals/" + part(goal.key) }, goal.id);

function step({ kind, goal, action, call }) {
  if (kind === "goal")
    return [goalLink(goal), goal.error ? el("span", { class: "bad-text" }, " " + goal.error) : null];
  if (kind === "action")
    return [
      el(
        "a",
        { href: "#/goals/" + part(goal.key) + "?action=" + part(action.id) },
        ["action", action.id, action.name, ...action.values].join(" "),
      ),
    ];
  return [
    call.guessed ? "probably " : "",
    el("a", { href: "#/log?time=" + (call.end ?? call.begin), title: "the log at this moment" }, call.text),
    el("span", { class: "dim" }, " of " + call.skiller),
    call.error ? el("span", { class: "bad-text" }, " " + call.error) : null,
  ];
}

function chain(model, goal, children) {
  return el(
    "ol",
    { class: "way", "aria-label": "the way to the failure" },
    wayToFailure(model, goal, children).map((each) =>
      el(
        "li",
        {},
        each.kind === "goal" ? outcomeBadge(goalOutcome(each.goal)) : outcomeBadge("failed", each.kind),
        " ",
        step(each),
      ),
    ),
  );
}

function runOutcome(roots) {
  const all = roots.map(goalOutcome);
  if (all.some(isOpen)) return all.includes("running") ? "running" : "formulated";
  return (
    ["failed", "rejected"].find((each) => all.includes(each)) ||
    (all.includes("completed") ? "completed" : "retracted")
  );
}

/** How many of what have which outcome: a bar, and words for those who do not see it. */
function outcomeBar(label, counts) {
  const all = Object.values(counts).reduce((sum, each) => sum + each, 0);
  if (!all) return null;
  const used = NAMES.filter((name) => counts[name]);
  const bar = el(
    "span",
    { class: "stack", "aria-hidden": "true" },
    used.map((name) => {
      const piece = el("i", { class: "outcome o-" + name });
      piece.style.flexGrow = counts[name];
      return piece;
    }),
  );
  return el(
    "tr",
    {},
    el("th", { scope: "row" }, label),
    el("td", { class: "n" }, String(all)),
    el("td", { class: "stack-cell" }, bar),
    el(
      "td",
      {},
      used.map((name) => [outcomeBadge(name, counts[name] + " " + OUTCOMES[name].word), " "]),
    ),
  );
}
function count(items, outcomeOf) {
  const counts = {};
  for (const item of items) {
    const outcome = outcomeOf(item);
    counts[outcome] = (counts[outcome] || 0) + 1;
  }
  return counts;
}

function classTable(goals, now) {
  const classes = new Map();
  for (const goal of goals) {
    if (!classes.has(goal.cls)) classes.set(goal.cls, []);
    classes.get(goal.cls).push(goal);
  }
  const sorted = [...classes].sort((a, b) => b[1].length - a[1].length).slice(0, MOST * 2);
  return sorted.map(([cls, all]) => {
    const times = all.map((goal) => durationOf(goal, now)).filter((each) => each && !each.waited);
    const longest = Math.max(0, ...times.map((each) => each.us));
    const row = outcomeBar(cls, count(all, goalOutcome));
    row.append(el("td", { class: "n dim" }, times.length ? durationText(longest) : ""));
    return row;
  });
}

/** @param goals all that are known; parents Map goal's key -> parent's key */
export function runSummary(app, goals, parents) {
  const { model } = app;
  if (!goals.length)
    return none(
      "Nothing has happened yet",
      app.recording
        ? "No goal is there at this moment of the recording."
        : "The run's outcome, its counts and what failed are shown here as soon as there are goals.",
    );
  const roots = goals.filter((goal) => !parents.get(goal.key)),
    children = childrenOf(goals, parents),
    { roots: failed, overcome } = failures(goals, parents),
    outcome = runOutcome(roots);
  const begin = Math.min(...goals.map((goal) => (goal.history[0] || { time: Infinity }).time)),
    isOver = !isOpen(outcome),
    last = Math.max(...goals.map((goal) => (goal.history.at(-1) || { time: 0 }).time)),
    end = isOver ? last : app.now;
  const actions = [...model.actions.values()].flatMap((each) => [...each.values()]),
    levels = count(model.log, (line) => line.level);
  return el(
    "div",
    { id: "run" },
    el("div", { class: "detail-head" }, el("h2", {}, "The run"), outcomeBadge(outcome)),
    pairs([
      ["began", Number.isFinite(begin) ? clockText(begin, 3) : ""],
      [isOver ? "ended" : "", isOver && last ? clockText(last, 3) : ""],
      ["duration", Number.isFinite(begin) ? durationText(Math.max(0, end - begin)) : ""],
      [
        "log",
        [(levels.E || 0) + " errors, ", (levels.W || 0) + " warnings ", el("a", { href: "#/log" }, "show")],
      ],
    ]),
    wideTable(
      { class: "counts" },
      [],
      [
        outcomeBar("goals", count(goals, goalOutcome)),
        outcomeBar(
          "actions",
          count(actions, (each) => actionOutcome(each.state)),
        ),
        outcomeBar(
          "skill calls",
          count(model.calls, (call) => skillOutcome(call.status)),
        ),
      ],
    ),
    failed.length
      ? el(
          "section",
          {},
          el("h3", {}, failed.length === 1 ? "What failed, and why" : failed.length + " root goals failed"),
          failed.slice(0, MOST).map((goal) => chain(model, goal, children)),
        )
      : null,
    overcome.length
      ? el(
          "section",
          {},
          el("h3", {}, "Failed on the way (" + overcome.length + ")"),
          overcome.slice(0, MOST).map((goal) => chain(model, goal, children)),
          overcome.length > MOST
            ? el("p", { class: "dim" }, "and " + (overcome.length - MOST) + " more")
            : null,
        )
      : null,
    el("h3", {}, "Goals by class"),
    wideTable(
      { class: "counts" },
      ["class", "goals", el("th", { scope: "col", class: "stack-cell" }), "outcomes", "longest"],
      classTable(goals, app.now),
    ),
  );
}
