// An exploration: a map of its runs, what faults lead to, and what no run has reached.
import { el, svg } from "cx/dom.js";
import { command, modes, notes, outcomes, section, table } from "cx/documents/parts.js";

const ROW = 18,
  BAR = 8,
  HEAD = 22,
  CHART = 560,
  WIDTH = 1100,
  LETTERS = 74,
  TICKS = 5,
  MOST_DRAWN = 400; // of more, those that violate a property and those with the fewest faults are drawn
const TONES = { completed: "good", unsuccessful: "failed", merged: "none", open: "none" };

/** The numbers of the rows that are drawn, with those that they left. */
export function drawnOf(rows, most = MOST_DRAWN) {
  const wanted = [...rows.keys()].sort(
    (one, other) =>
      (rows[one].violations.length === 0) - (rows[other].violations.length === 0) ||
      rows[one].faults - rows[other].faults ||
      one - other,
  );
  const drawn = new Set();
  for (const number of wanted) {
    const line = [];
    for (let above = number; above !== null && !drawn.has(above); above = rows[above].parent)
      line.push(above);
    if (drawn.size + line.length <= most) for (const each of line) drawn.add(each);
  }
  return [...drawn].sort((one, other) => one - other);
}

function tick(seconds, at, bottom) {
  return [
    svg("line.tick", { x1: at, x2: at, y1: HEAD - 4, y2: bottom }),
    svg.text({ x: at, y: 12 }, seconds.toFixed(1) + " s"),
  ];
}

function run(row, place, places, x) {
  const middle = HEAD + ROW * place + ROW / 2,
    left = x(row.begin_s),
    right = x(row.end_s),
    words = row.path.join("; ") || "nothing but the usual",
    end = row.reason ? row.outcome + ": " + row.reason : row.outcome,
    text = (row.violations.length ? "✖ " : "") + (row.choice || "the usual run"),
    above = row.parent === null ? null : HEAD + ROW * places.get(row.parent) + ROW / 2;
  return svg(
    row.page ? "a" : "g",
    row.page ? { href: row.page, "aria-label": text + ", " + row.outcome } : {},
    svg.title([words, end, ...row.violations].join("\n")),
    above === null ? null : svg.path({ d: "M" + left + " " + above + " V" + middle }),
    svg.rect({
      class: TONES[row.outcome] || "bad",
      x: left,
      y: middle - BAR / 2,
      width: Math.max(right - left, 3),
      height: BAR,
      rx: 2,
    }),
    svg.text(
      { class: row.violations.length ? "violated" : null, x: CHART + 20, y: middle + 4 },
      text.length <= LETTERS ? text : text.slice(0, LETTERS - 1) + "…",
    ),
  );
}

function map(rows) {
  const drawn = drawnOf(rows),
    end = Math.max(...drawn.map((number) => rows[number].end_s)) || 1,
    height = HEAD + ROW * drawn.length + 4,
    places = new Map(drawn.map((number, place) => [number, place])),
    x = (seconds) => 4 + (CHART * seconds) / end;
  return [
    notes(
      drawn.length === rows.length
        ? []
        : [rows.length - drawn.length + " runs of " + rows.length + " are not drawn"],
    ),
    el(
      "div.wide",
      { tabindex: 0, role: "region", "aria-label": "Runs" },
      svg(
        "svg.runs",
        {
          viewBox: "0 0 " + WIDTH + " " + height,
          role: drawn.some((number) => rows[number].page) ? "group" : "img",
          "aria-label": drawn.length + " runs over time; the table below tells how they ended",
        },
        Array.from({ length: TICKS }, (_, at) => tick((end * at) / TICKS, x((end * at) / TICKS), height)),
        drawn.map((number, place) => run(rows[number], place, places, x)),
      ),
    ),
    el(
      "p.dim",
      "A bar begins where its run did other than the one above, from which the line comes. ",
      drawn.some((number) => rows[number].page) ? "A bar that is a link opens its run at that moment. " : "",
      "Green: completed; orange: unsuccessful; red: stuck, or worse; grey: goes on as another run does.",
    ),
  ];
}

/** The choices by which runs left others, with the ends of those runs. */
function faults(rows) {
  const found = new Map();
  for (const { choice, outcome } of rows) {
    if (!choice) continue;
    if (!found.has(choice)) found.set(choice, new Map());
    const ends = found.get(choice);
    ends.set(outcome, (ends.get(outcome) || 0) + 1);
  }
  const lines = [...found].map(([choice, ends]) => [
    choice,
    [...ends.values()].reduce((sum, count) => sum + count, 0),
    [...ends].map(([outcome, count]) => count + " " + outcome).join(", "),
  ]);
  lines.sort((one, other) => other[1] - one[1] || (one[0] < other[0] ? -1 : 1));
  return table(["choice", "runs", "ended"], lines, { numbers: [1], empty: "the world had no choice" });
}

function properties(list) {
  const words = { violated: el.b("violated"), vacuous: "vacuous", holds: "holds" };
  return table(
    ["property", "", ""],
    list.map(({ name, verdict, message }) => [
      name,
      words[verdict].cloneNode?.(true) || words[verdict],
      message,
    ]),
    { empty: "no properties" },
  );
}

/** The violated properties first: each begins with its shortest story. */
const violations = (list) =>
  list
    .filter(({ verdict }) => verdict === "violated")
    .map(({ name, message, story, address }) =>
      el(
        "div.violation",
        el.h3("✖ " + name),
        el.p(message),
        story ? el.p("The shortest run in which that happens: ", story, ".") : null,
        address ? el.p(el.a({ href: address }, "Open this run")) : null,
      ),
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
      (never[name] || []).length ? modes(never[name]) : "-",
    ]),
    { empty: "no goals" },
  );

const AGAIN_MS = 2500;

/** Show an exploration. */
export function open(main, report) {
  const broken = violations(report.properties);
  if (report.live) setTimeout(() => location.reload(), AGAIN_MS);
  main.append(
    el(
      "div.document",
      el("p.verdict", { role: "status" }, report.live ? "Exploring: " : "", report.summary),
      command(report.command),
      broken.length ? section("violations", "Violations", broken) : null,
      section("map", "Runs", map(report.rows)),
      section("faults", "What faults lead to", faults(report.rows)),
      section("properties", "Properties", properties(report.properties)),
      report.coverage
        ? [
            section("unreached", "What no run has reached", unreached(report.coverage)),
            section("goals", "Goals", goalsOf(report.coverage.goals)),
          ]
        : null,
    ),
  );
}
