// A comparison of two runs: what `cxbridge trace diff --json` prints.
import { el, none, pairs, wideTable } from "cx/dom.js";
import { notes, section } from "cx/documents/parts.js";
import { goalOutcome, outcomeBadge } from "cx/outcome.js";

const SIGNS = {
  changed: "≠",
  "only-a": "−",
  "only-b": "+",
  order: "⇅",
  msgid: "#",
  time: "◷",
  count: "×",
};
const LISTED = 200, // differences after the first
  LONGEST = 400; // characters of an event

const short = (text) =>
  text.length <= LONGEST ? text : text.slice(0, LONGEST / 2) + " ... " + text.slice(-LONGEST / 2);

const sign = ({ kind }) =>
  el("span", { class: "sign", role: "img", "aria-label": kind, title: kind }, SIGNS[kind]);

const sides = (make) =>
  el(
    "div",
    { class: "sides" },
    ["a", "b"].map((side) => el("div", {}, el("h3", { class: "side" }, side.toUpperCase()), make(side))),
  );

const said = ({ event, text }) => [
  event === null ? null : el("span", { class: "dim" }, event + " "),
  el("code", {}, short(text)),
];

function cells(difference) {
  const { subject, what, a, b } = difference;
  return [
    el("td", {}, sign(difference)),
    el("td", {}, subject ? [el("b", {}, short(subject)), el("br")] : null, what),
    el("td", {}, said(a)),
    el("td", {}, said(b)),
  ];
}

const differences = (list, extra = () => []) => list.map((each) => el("tr", {}, cells(each), extra(each)));

function lineCells(line) {
  if (!line) return el("td", { class: "gap", colspan: 3 });
  const text = short(line.text);
  return [
    el("td", { class: "n" }, String(line.number)),
    el("td", { class: "n dim" }, line.seconds.toFixed(3) + " s"),
    el("td", { class: "what" }, el("code", {}, line.here ? el("b", {}, text) : text)),
  ];
}

function alignedRow({ a, b, same }) {
  const [mark, word] = same
      ? ["", ""]
      : !b
        ? ["−", "only A has it"]
        : !a
          ? ["+", "only B has it"]
          : ["≠", "differ"],
    kind = same ? "same" : a && b ? "changed" : "one";
  const signed = mark ? el("span", { role: "img", "aria-label": word }, mark) : null;
  return el("tr", { class: kind }, lineCells(a), el("td", { class: "sign" }, signed), lineCells(b));
}

const aligned = (rows) =>
  wideTable(
    { class: "aligned" },
    [el("th", { scope: "col", colspan: 3 }, "A"), el("th"), el("th", { scope: "col", colspan: 3 }, "B")],
    rows.map(alignedRow),
  );

const events = (lines) =>
  wideTable(
    {},
    ["event", "seconds", "what"],
    lines.map((line) => el("tr", {}, lineCells(line))),
  );

const rules = (list) =>
  list.length
    ? el(
        "ol",
        { class: "rules" },
        list.map((rule) => el("li", {}, el("code", {}, rule))),
      )
    : none("no firings recorded");

const stateOf = ({ depth, goal_class: kind, mode, outcome }) => JSON.stringify([depth, kind, mode, outcome]);

/** The goals of a side as a list with indents; those that the other side has not are marked. */
function goals(list, others) {
  const left = others.map(stateOf);
  const rows = list.map((goal) => {
    const at = left.indexOf(stateOf(goal));
    if (at >= 0) left.splice(at, 1);
    return el(
      "li",
      { class: at < 0 ? "marked" : null, style: "margin-left: " + Math.min(goal.depth, 12) + "em" },
      el("b", {}, goal.goal),
      " " + goal.goal_class + " ",
      outcomeBadge(goalOutcome(goal), goal.mode + (goal.outcome === "UNKNOWN" ? "" : " " + goal.outcome)),
      goal.error ? el("span", { class: "error" }, " " + goal.error) : null,
      at < 0 ? el("span", { class: "remark" }, " the other side has not") : null,
    );
  });
  return rows.length ? el("ul", { class: "plain" }, rows) : none("no goals");
}

function* first({ differences: [difference], first: context }) {
  const { subject, what, a, b } = difference;
  yield section(
    "first",
    "First difference",
    el("p", {}, sign(difference), subject ? el("b", {}, " " + short(subject) + ":") : null, " " + what),
    sides((side) => el("p", { class: "code" }, said({ a, b }[side]))),
  );
  yield context.rows.length
    ? section("around", "Side by side", aligned(context.rows))
    : section(
        "around",
        "What led to it",
        sides((side) => events(context[side].lines)),
      );
  yield section(
    "rules",
    "Rules that fired just before",
    sides((side) => rules(context[side].rules)),
  );
  yield section(
    "goals",
    "Goals at that point",
    sides((side) => goals(context[side].goals, context[side === "a" ? "b" : "a"].goals)),
  );
}

function further({ differences: [, ...more], total }) {
  const shown = more.slice(0, LISTED),
    left = total - 1 - shown.length;
  return section(
    "further",
    "Further differences",
    wideTable({}, ["", "what", "A", "B"], differences(shown)),
    left > 0 ? el("p", { class: "dim" }, "and " + left + " more") : null,
  );
}

const accepted = (list) =>
  section(
    "accepted",
    "Accepted differences",
    wideTable(
      {},
      ["", "what", "A", "B", "reason"],
      differences(list, ({ reason }) => el("td", {}, reason)),
    ),
  );

/** Show a comparison. */
export function open(main, report) {
  const { same, summary, a, b, options } = report,
    given = Object.entries(options).filter(
      ([name, value]) => value && value.length !== 0 && name !== "time_from",
    ),
    remarks = [...report.hints, ...report.notes, ...report.baseline_unused.map((each) => "not met: " + each)];
  main.append(
    el(
      "div",
      { class: "comparison" },
      el(
        "p",
        { class: "verdict " + (same ? "same" : "differ") },
        el("i", { "aria-hidden": "true" }, same ? "=" : "≠"),
        summary,
      ),
      pairs([["A", a.path], ["B", b.path], ...given.map(([name, value]) => [name, String(value)])]),
      notes(remarks),
      report.differences.length ? [...first(report)] : null,
      report.total > 1 && report.differences.length ? further(report) : null,
      report.accepted.length ? accepted(report.accepted) : null,
    ),
  );
}
