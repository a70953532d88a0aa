// An exploration: a map of its runs, what faults lead to, and what no run has reached.
import { el, link, note } from "cx/dom.js";
import { lanes } from "cx/documents/lanes.js";
import { modes, notes, outcomes, show, table } from "cx/documents/parts.js";

const MOST_DRAWN = 400, // of more, those that violate a property and those with the fewest faults are drawn
  LABELS = 320,
  AGAIN_MS = 2500;
const KINDS = { completed: "good", unsuccessful: "failed", merged: "none", open: "none" };

/** The numbers of the rows that are drawn, with those that they left. */
export function drawnOf(rows, most = MOST_DRAWN) {
  const isSound = (number) => rows[number].violations.length === 0,
    wanted = [...rows.keys()].sort(
      (one, other) => isSound(one) - isSound(other) || rows[one].faults - rows[other].faults || one - other,
    ),
    drawn = new Set();
  for (const number of wanted) {
    const line = [];
    for (let above = number; above !== null && !drawn.has(above); above = rows[above].parent)
      line.push(above);
    if (drawn.size + line.length <= most) for (const each of line) drawn.add(each);
  }
  return [...drawn].sort((one, other) => one - other);
}

function map(rows) {
  const drawn = drawnOf(rows),
    places = new Map(drawn.map((number, place) => [number, place])),
    hasLinks = drawn.some((number) => rows[number].page);
  const lane = (number) => {
    const { begin_s: begin, end_s: end, parent, page, outcome, ...row } = rows[number],
      words = row.path.join("; ") || "nothing but the usual",
      how = row.reason ? outcome + ": " + row.reason : outcome,
      title = [words, how, ...row.violations].join("\n"),
      from = parent === null ? -1 : places.get(parent);
    return {
      label: (row.violations.length ? "✖ " : "") + (row.choice || "the usual run"),
      kind: row.violations.length ? "violated" : null,
      bars: [{ begin, end, kind: KINDS[outcome] || "bad", title, href: page, from }],
    };
  };
  const left = rows.length - drawn.length,
    end = Math.max(...drawn.map((number) => rows[number].end_s)),
    about = drawn.length + " runs over time; the table below tells how they ended";
  return [
    notes(left ? [left + " runs of " + rows.length + " are not drawn"] : []),
    lanes([{ lanes: drawn.map(lane) }], end, about, { labels: LABELS, kind: "runs" }),
    note(
      "A bar begins where its run did other than the one above, from which the line comes. ",
      hasLinks ? "A bar that is a link opens its run at that moment. " : "",
      "Green: completed; orange: unsuccessful; red: stuck, or worse; grey: goes on as another run does.",
    ),
  ];
}

/** The choices by which runs left others, with the ends of those runs. */
function faults(rows) {
  const found = Map.groupBy(
    rows.filter(({ choice }) => choice),
    ({ choice }) => choice,
  );
  const lines = [...found].map(([choice, of]) => {
    const ends = [...Map.groupBy(of, ({ outcome }) => outcome)];
    return [choice, of.length, ends.map(([outcome, all]) => all.length + " " + outcome).join(", ")];
  });
  lines.sort((one, other) => other[1] - one[1] || (one[0] < other[0] ? -1 : 1));
  return table(["choice", "runs", "ended"], lines, { numbers: [1], empty: "the world had no choice" });
}

const properties = (list) =>
  table(
    ["property", "", ""],
    list.map(({ name, verdict, message }) => [
      name,
      verdict === "violated" ? el.b(verdict) : verdict,
      message,
    ]),
    { empty: "no properties" },
  );

/** The violated properties first: each begins with its shortest story. */
const violation = ({ name, message, story, address }) =>
  el(
    "div.violation",
    el.h3("✖ " + name),
    el.p(message),
    story ? el.p("The shortest run in which that happens: ", story, ".") : null,
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
    table(["what", "where", "name"], lines, { empty: "all was reached" }),
  ];
}

const goalsOf = ({ outcomes: ended, modes_never_reached: never }) =>
  table(
    ["class", "outcomes", "never in the mode"],
    Object.entries(ended).map(([name, ends]) => [
      name,
      ends.length ? outcomes(ends) : "-",
      never[name]?.length ? modes(never[name]) : "-",
    ]),
    { empty: "no goals" },
  );

export function open(main, { live, summary, command, properties: all, rows, coverage }) {
  const broken = all.filter(({ verdict }) => verdict === "violated");
  if (live) setTimeout(() => location.reload(), AGAIN_MS);
  show(main, { verdict: (live ? "Exploring: " : "") + summary, command }, [
    broken.length > 0 && ["violations", "Violations", broken.map(violation)],
    ["map", "Runs", map(rows)],
    ["faults", "What faults lead to", faults(rows)],
    ["properties", "Properties", properties(all)],
    coverage && ["unreached", "What no run has reached", unreached(coverage)],
    coverage && ["goals", "Goals", goalsOf(coverage.goals)],
  ]);
}
