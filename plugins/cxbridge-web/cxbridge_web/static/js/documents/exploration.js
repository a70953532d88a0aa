// An exploration: a map of its runs, the effects of faults, and the parts of the agent that no run reached.
import { el, link, none, note, plural, wideTable } from "cx/dom.js";
import { lanes } from "cx/documents/lanes.js";
import { notes, section } from "cx/documents/parts.js";
import { goalOutcome, outcomeBadge } from "cx/outcome.js";

const MOST_DRAWN = 400, // first the runs that violate a property, then the runs with the fewest faults
  RELOAD_MS = 2500; // the period of a document that grows during an exploration
// the classes of bars by the outcome of the run; "bad" for other outcomes
const KINDS = { completed: "good", unsuccessful: "failed", merged: "none", open: "none" };

const table = (heads, rows, empty, numbers = []) =>
  rows.length ? wideTable({}, heads, rows, numbers) : none(empty);
const badges = (names, goalOf) =>
  names?.length ? names.map((name) => [outcomeBadge(goalOutcome(goalOf(name)), name), " "]) : "-";

/**
 * Select the runs to draw. The run that a drawn run left is drawn, too.
 * @returns the indices of their rows, ascending
 */
function selectRows(rows) {
  const isSound = (number) => rows[number].violations.length === 0,
    byImportance = [...rows.keys()].sort(
      (one, other) => isSound(one) - isSound(other) || rows[one].faults - rows[other].faults || one - other,
    ),
    drawn = new Set();
  for (const number of byImportance) {
    const lineage = []; // the row and its ancestors that are not drawn yet
    for (let above = number; above !== null && !drawn.has(above); above = rows[above].parent)
      lineage.push(above);
    if (drawn.size + lineage.length <= MOST_DRAWN) for (const ancestor of lineage) drawn.add(ancestor);
  }
  return [...drawn].sort((one, other) => one - other);
}

/** The map of the runs, with notes. */
function map(rows) {
  const drawn = selectRows(rows),
    places = new Map(drawn.map((number, place) => [number, place])),
    hasLinks = drawn.some((number) => rows[number].page);
  const lane = (number) => {
    const { begin_s: begin, end_s: end, parent, page, outcome, ...row } = rows[number],
      choices = row.path.join("; ") || "nothing but the usual",
      ending = row.reason ? outcome + ": " + row.reason : outcome,
      title = [choices, ending, ...row.violations].join("\n"),
      isViolated = row.violations.length > 0,
      label = (isViolated ? "✖ " : "") + (row.choice || "the usual run"),
      from = parent === null ? -1 : places.get(parent);
    return { label, isViolated, begin, end, kind: KINDS[outcome] || "bad", title, href: page, from };
  };
  const undrawnCount = rows.length - drawn.length,
    end = Math.max(...drawn.map((number) => rows[number].end_s)),
    about = plural(drawn.length, "run") + " over time; the table below tells how they ended";
  return [
    notes(undrawnCount ? [undrawnCount + " runs of " + rows.length + " are not drawn"] : []),
    lanes(drawn.map(lane), end, about),
    note(
      "A bar begins where its run left another run, from whose bar the line comes. ",
      hasLinks ? "A bar that is a link opens its run at that moment. " : "",
      "Green: completed; orange: unsuccessful; red: stuck, or worse; ",
      "grey: continues like another run, or is not explored to its end.",
    ),
  ];
}

/** The table of the choices by which runs left another run, and how these runs ended. */
function faults(rows) {
  const rowsByChoice = Map.groupBy(
    rows.filter(({ choice }) => choice),
    ({ choice }) => choice,
  );
  const lines = [...rowsByChoice].map(([choice, runs]) => {
    const ends = [...Map.groupBy(runs, ({ outcome }) => outcome)];
    return [choice, runs.length, ends.map(([outcome, ended]) => ended.length + " " + outcome).join(", ")];
  });
  // the most frequent choice first
  lines.sort(([choice, count], [other, otherCount]) => otherCount - count || (choice < other ? -1 : 1));
  return table(["choice", "runs", "ended"], lines, "the world had no choice", [1]);
}

const properties = (list) =>
  table(
    ["property", "", ""],
    list.map(({ name, verdict, message }) => [
      name,
      verdict === "violated" ? el.b(verdict) : verdict,
      message,
    ]),
    "no properties",
  );

/** A violated property, with the story of the shortest run that violates it. */
const violation = ({ name, message, story, address }) =>
  el(
    "div.violation",
    el.h3("✖ " + name),
    el.p(message),
    story ? el.p("The shortest run with the violation: ", story, ".") : null,
    address ? el.p(link(address, "Open this run")) : null,
  );

function unreached({ rules, goals, actions }) {
  const lines = [
    ...rules.never.map(({ file, line, rule }) => ["rule", file + ":" + line, rule]),
    ...goals.never.map((name) => ["goal class", "", name]),
    ...actions.never.map((name) => ["action", "", name]),
  ];
  return [
    el.p(rules.fired + " of " + rules.of + " rules fired"),
    table(["what", "where", "name"], lines, "everything was reached"),
  ];
}

/** The table of goal classes: the outcomes that goals had, and the modes that no goal reached. */
const goalsOf = ({ outcomes: outcomesByClass, modes_never_reached: neverByClass }) =>
  table(
    ["class", "outcomes", "never in the mode"],
    Object.entries(outcomesByClass).map(([name, outcomes]) => [
      name,
      badges(outcomes, (outcome) => ({ mode: "FINISHED", outcome })),
      badges(neverByClass[name], (mode) => ({ mode, outcome: "" })),
    ]),
    "no goals",
  );

export function open(main, { live, summary, command, properties: allProperties, rows, coverage }) {
  const violated = allProperties.filter(({ verdict }) => verdict === "violated");
  if (live) setTimeout(() => location.reload(), RELOAD_MS);
  const sections = [
    violated.length > 0 && ["violations", "Violations", violated.map(violation)],
    ["map", "Runs", map(rows)],
    ["faults", "What faults lead to", faults(rows)],
    ["properties", "Properties", properties(allProperties)],
    coverage && ["unreached", "What no run has reached", unreached(coverage)],
    coverage && ["goals", "Goals", goalsOf(coverage.goals)],
  ];
  main.append(
    el(
      "div.document",
      el("p.verdict", { role: "status" }, (live ? "Exploring: " : "") + summary),
      el.p(el.code(command)),
      sections.filter(Boolean).map((parameters) => section(...parameters)),
    ),
  );
}
