// Two runs side by side: `cxbridge view A B`, and the page of `cxbridge trace diff --html`.
import { button, el, none, pairs, wideTable } from "cx/dom.js";
import { notes, section } from "cx/documents/parts.js";
import { goalOutcome, OUTCOMES, outcomeBadge } from "cx/outcome.js";

const SIGNS = { changed: "≠", "only-a": "−", "only-b": "+", order: "⇅", msgid: "#", time: "◷", count: "×" };
const LISTED = 200,
  LONGEST = 400; // characters of an event
const SIDES = ["a", "b"];

const short = (text) =>
  text.length <= LONGEST ? text : text.slice(0, LONGEST / 2) + " ... " + text.slice(-LONGEST / 2);
const sign = ({ kind }) => el("span.sign", { role: "img", "aria-label": kind, title: kind }, SIGNS[kind]);
const sides = (make) =>
  el(
    "div.sides",
    SIDES.map((side) => el.div(el("h3.side", side.toUpperCase()), make(side))),
  );
const said = ({ event, text }) => [event === null ? null : el("span.dim", event + " "), el.code(short(text))];
const stateOf = ({ mode, outcome }) => mode + (outcome === "UNKNOWN" ? "" : " " + outcome);

/** Where the page of a run shows a moment of it; null: only the comparison is here. */
function addressOf({ runs, start_us: begin }, side, view, seconds) {
  if (!runs) return null;
  const time = seconds === undefined ? "" : "?time=" + Math.round(begin[side] + seconds * 1e6);
  return runs[side] + "#/" + view + time;
}
const linkTo = (href, attributes, ...children) =>
  href ? el.a({ href, ...attributes }, ...children) : el.span(attributes, ...children);

function lineCells(line, report, side) {
  if (!line) return el("td.gap", { colspan: 2 });
  const text = short(line.text),
    when = line.seconds.toFixed(3) + " s";
  return [
    el("td.n.dim", linkTo(addressOf(report, side, "timeline", line.seconds), {}, when)),
    el("td.what", el.code(line.here ? el.b(text) : text)),
  ];
}

function alignedRow({ a, b, same }, report) {
  const [mark, word] = same
    ? ["", ""]
    : !b
      ? ["−", "only A has it"]
      : !a
        ? ["+", "only B has it"]
        : ["≠", "differ"];
  return el.tr(
    { class: same ? "same" : a && b ? "changed" : "one" },
    lineCells(a, report, "a"),
    el("td.sign", mark ? el.span({ role: "img", "aria-label": word }, mark) : null),
    lineCells(b, report, "b"),
  );
}

/** The events around a difference: next to each other where they are aligned. */
function steps(number, report) {
  const rows = number === 0 ? report.first.rows : [];
  if (rows.length)
    return wideTable(
      { class: "aligned" },
      [el.th({ scope: "col", colspan: 2 }, "A"), el.th(), el.th({ scope: "col", colspan: 2 }, "B")],
      rows.map((row) => alignedRow(row, report)),
    );
  return sides((side) => {
    const { lines } = report.contexts[number][side];
    return lines.length
      ? wideTable(
          { class: "aligned" },
          [],
          lines.map((line) => el.tr(lineCells(line, report, side))),
        )
      : none("This run has nothing like it");
  });
}

function rules(list) {
  if (!list.length) return none("No firings are recorded", "Record with --trace-level rules.");
  return el(
    "ol.rules",
    list.map((rule) => el.li(el.code(rule))),
  );
}

/** The goals of a side as a list with indents; those that the other side does not have are marked. */
function goals(list, others) {
  const keyOf = (goal) => JSON.stringify([goal.depth, goal.goal_class, stateOf(goal)]),
    left = others.map(keyOf);
  const rows = list.map((goal) => {
    const at = left.indexOf(keyOf(goal));
    if (at >= 0) left.splice(at, 1);
    return el.li(
      { class: at < 0 ? "marked" : null, style: "margin-left: " + Math.min(goal.depth, 12) + "em" },
      el.b(goal.goal),
      " " + goal.goal_class + " ",
      outcomeBadge(goalOutcome(goal), stateOf(goal)),
      goal.error ? el("span.error", " " + goal.error) : null,
      at < 0 ? el("span.remark", " the other run differs") : null,
    );
  });
  return rows.length ? el("ul.plain", rows) : none("no goals");
}

/** The seconds of a difference in a run; undefined where the run has nothing. */
const secondsOf = (context) => (context.lines.find(({ here }) => here) || {}).seconds;

// -- the goals of both runs, a row each

function bar(found, side, report) {
  if (!found) return el.span({ class: "pair-none " + side }, "not in " + side.toUpperCase());
  const longest = Math.max(report.end.a, report.end.b) || 1,
    { word, icon } = OUTCOMES[found.outcome],
    text = [side.toUpperCase() + ": " + found.goal, word, found.error].filter(Boolean).join(" "),
    left = (100 * found.begin) / longest,
    width = (100 * (found.end - found.begin)) / longest,
    href = addressOf(report, side, "goals/" + encodeURIComponent(found.goal));
  return linkTo(
    href,
    {
      class: "pair-bar o-" + found.outcome + " " + side,
      style: "left: " + left + "%; width: " + width + "%",
      title: text,
      "aria-label": text,
    },
    found.outcome === "completed" ? "" : icon,
  );
}

function goalRow(row, report) {
  const { a, b } = row,
    differs = !a || !b || a.outcome !== b.outcome || a.error !== b.error;
  return el.li(
    { class: differs ? "differs" : null },
    el(
      "span.pair-name",
      { style: "padding-left: " + (0.4 + Math.min(row.depth, 12) * 0.8) + "em" },
      row.label,
      differs ? el("b.sign", { "aria-label": "differs" }, " ≠") : null,
    ),
    el(
      "span.pair-track",
      SIDES.map((side) => bar(row[side], side, report)),
    ),
  );
}

/** @returns the rows, and a call that marks a difference in them */
function goalRows(report) {
  const longest = Math.max(report.end.a, report.end.b) || 1,
    marks = SIDES.map((side) => el.i({ class: "pair-mark " + side, hidden: true })),
    unit = report.unit === "s" ? " s" : " steps",
    number = (value) => (report.unit === "s" ? value.toFixed(1) : String(value));
  const node = el(
    "div.pair",
    el(
      "p.dim.pair-legend",
      "Each goal has two bars: A above, B below. ",
      "A took " + number(report.end.a) + unit + ", B " + number(report.end.b) + unit + ".",
    ),
    el("div.pair-marks", { "aria-hidden": "true" }, el.span(), el.span(marks)),
    el.ol(report.goals.map((row) => goalRow(row, report))),
    report.more_goals ? el("p.dim", "and " + report.more_goals + " more goals") : null,
  );
  function mark(context) {
    SIDES.forEach((side, at) => {
      const seconds = context && secondsOf(context[side]);
      marks[at].hidden = seconds === undefined || report.unit !== "s";
      marks[at].style.left = (100 * (seconds || 0)) / longest + "%";
    });
  }
  return { node, mark };
}

// -- the differences, one at a time

function differenceBox(number, report) {
  const difference = report.differences[number],
    { subject, what } = difference,
    context = report.contexts[number];
  return [
    el.p(sign(difference), subject ? el.b(" " + short(subject) + ":") : null, " " + what),
    sides((side) => [
      el("p.code", said(difference[side])),
      context && secondsOf(context[side]) !== undefined
        ? linkTo(
            addressOf(report, side, "timeline", secondsOf(context[side])),
            { class: "dim" },
            "at " + secondsOf(context[side]).toFixed(3) + " s",
          )
        : null,
    ]),
    context
      ? [
          el.h3("What led to it, step by step"),
          steps(number, report),
          el.h3("Rules that fired just before"),
          sides((side) => rules(context[side].rules)),
          el.h3("Goals at that point"),
          sides((side) => goals(context[side].goals, context[side === "a" ? "b" : "a"].goals)),
        ]
      : el("p.dim", "The causes of the first " + report.contexts.length + " are in the page."),
  ];
}

/** Walk through the differences. @param mark tells the rows of goals which one is shown */
function walk(report, mark) {
  const box = el.div({ "aria-live": "polite" }),
    title = el("h2#first"),
    total = report.differences.length;
  let shown = 0;
  const move = (by) => show(Math.min(Math.max(shown + by, 0), total - 1));
  const back = button("◂", () => move(-1), { "aria-label": "the difference before" }),
    next = button("▸", () => move(1), { "aria-label": "the next difference" });
  function show(number) {
    shown = number;
    title.textContent = number ? "Difference " + (number + 1) + " of " + report.total : "Where they part";
    back.disabled = number === 0;
    next.disabled = number === total - 1;
    box.replaceChildren(...differenceBox(number, report).flat(Infinity).filter(Boolean));
    mark(report.contexts[number]);
  }
  show(0);
  const list = report.differences.slice(0, LISTED).map((difference, number) =>
    el.tr(
      el.td(sign(difference)),
      el.td(
        button(
          (difference.subject ? short(difference.subject) + ": " : "") + difference.what,
          () => {
            show(number);
            title.scrollIntoView({ block: "center" });
          },
          { class: "quiet link" },
        ),
      ),
      SIDES.map((side) => el.td(said(difference[side]))),
    ),
  );
  const left = report.total - list.length;
  return [
    el.section({ "aria-labelledby": "first" }, el("div.walk", title, total > 1 ? [back, next] : null), box),
    total > 1
      ? section(
          "all",
          "All differences",
          wideTable({}, ["", "what", "A", "B"], list),
          left > 0 ? el("p.dim", "and " + left + " more") : null,
        )
      : null,
  ];
}

/** The sentence that says where the runs part. */
function parting(report) {
  if (report.same) return null;
  const [context] = report.contexts,
    at = SIDES.map((side) => [side.toUpperCase(), context && secondsOf(context[side])]).filter(
      ([, seconds]) => seconds !== undefined && report.unit === "s",
    );
  return el.p(
    "They part",
    at.length
      ? " at " + at.map(([name, seconds]) => seconds.toFixed(3) + " s in " + name).join(", ")
      : " there",
    ": A has ",
    el.code(short(report.differences[0].a.text)),
    ", B has ",
    el.code(short(report.differences[0].b.text)),
    ".",
  );
}

/** Show a comparison. */
export function open(main, report) {
  const { same, summary, a, b, options } = report,
    given = Object.entries(options).filter(
      ([name, value]) => value && value.length !== 0 && name !== "time_from",
    ),
    remarks = [...report.hints, ...report.notes],
    { node, mark } = goalRows(report);
  const run = (side, { path }) => [
    linkTo(addressOf(report, side, "timeline"), { title: "open this run" }, path),
    report.headlines ? el("span.dim", " " + report.headlines[side]) : null,
  ];
  main.append(
    el(
      "div.comparison",
      el.div(
        { class: "verdict " + (same ? "same" : "differ") },
        el.p(el.i({ "aria-hidden": "true" }, same ? "=" : "≠"), summary),
        report.differences.length ? parting(report) : null,
      ),
      pairs([["A", run("a", a)], ["B", run("b", b)], ...given.map(([name, value]) => [name, String(value)])]),
      notes(remarks),
      report.goals.length ? section("goals", "Goals of both runs", node) : null,
      report.differences.length ? walk(report, mark) : null,
    ),
  );
}
