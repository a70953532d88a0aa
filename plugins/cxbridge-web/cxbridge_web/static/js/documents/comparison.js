// Two runs side by side: `cxbridge view A B`, and the page of `cxbridge trace diff --html`.
import { button, dim, el, none, note, pairs, plural, refill, secondsText, wideTable } from "cx/dom.js";
import { notes, section } from "cx/documents/parts.js";
import { OUTCOMES } from "cx/outcome.js";

// the signs of the kinds of differences
const SIGNS = { changed: "≠", "only-a": "−", "only-b": "+", order: "⇅", msgid: "#", time: "◷", count: "×" };
const MOST_LISTED = 200, // differences in the list
  LONGEST_TEXT = 400; // characters of an event
const SIDES = ["a", "b"];

const shortened = (text) =>
  text.length <= LONGEST_TEXT
    ? text
    : text.slice(0, LONGEST_TEXT / 2) + " ... " + text.slice(-LONGEST_TEXT / 2);
const sign = ({ kind }) => el("span.sign", { role: "img", "aria-label": kind, title: kind }, SIGNS[kind]);
/** @param make(side) the content of a side, "a" or "b" */
const sides = (make) =>
  el(
    "div.sides",
    SIDES.map((side) => el.div(el("h3.side", side.toUpperCase()), make(side))),
  );
/** The kind of an event and its text; without a kind if the run has no such event. */
const eventText = ({ event, text }) => [event === null ? null : dim(event + " "), el.code(shortened(text))];
/**
 * The time of a difference in seconds into one run; if the run lacks the event, that of the preceding event.
 * Undefined if there is no such event or no context.
 */
const secondsOf = (context) => context?.lines.find(({ here }) => here)?.seconds;

/** The address of a moment on the page of a run; null: the page has only the comparison. */
function addressOf({ runs, start_us: begin }, side, view, seconds) {
  if (!runs) return null;
  const time = seconds === undefined ? "" : "?time=" + Math.round(begin[side] + seconds * 1e6);
  return runs[side] + "#/" + view + time;
}
const linkTo = (href, attributes, ...children) =>
  href ? el.a({ href, ...attributes }, ...children) : el.span(attributes, ...children);
const momentLink = (report, side, seconds, attributes, text) =>
  linkTo(addressOf(report, side, "timeline", seconds), attributes, text + secondsText(seconds));

function lineCells(line, report, side) {
  const text = shortened(line.text);
  return [
    el("td.n.dim", momentLink(report, side, line.seconds, {}, "")),
    el("td.what", el.code(line.here ? el.b(text) : text)),
  ];
}

/** The events around a difference, in two columns. @param number the index of the difference */
const surroundings = (number, report) =>
  sides((side) => {
    const lines = report.contexts[number][side].lines.map((line) => lineCells(line, report, side));
    return lines.length ? wideTable({ class: "aligned" }, [], lines) : none("This run has no such event");
  });

const rules = (list) =>
  list.length
    ? el(
        "ol.rules",
        list.map((rule) => el.li(el.code(rule))),
      )
    : none("No firings are recorded", "Record with --trace-level rules.");

// -- the goals of both runs, a row for each goal

/** The end of the longer run, in the unit of the report; 1 for empty runs, since bars divide by it. */
const longestOf = ({ end }) => Math.max(end.a, end.b) || 1;

/** @param entry the goal in the run of this side; null: this run has no such goal */
function bar(entry, side, report) {
  const name = side.toUpperCase();
  if (!entry) return el.span({ class: "pair-none " + side }, "not in " + name);
  const { goal, outcome, error, begin, end } = entry,
    { word, icon } = OUTCOMES[outcome],
    text = [name + ": " + goal, word, error].filter(Boolean).join(" "),
    [left, width] = [begin, end - begin].map((value) => (100 * value) / longestOf(report)); // percent
  const attributes = {
    class: "pair-bar o-" + outcome + " " + side,
    style: "left: " + left + "%; width: " + width + "%",
    title: text,
    "aria-label": text,
  };
  const href = addressOf(report, side, "goals/" + encodeURIComponent(goal));
  return linkTo(href, attributes, outcome === "completed" ? "" : icon);
}

function goalRow({ a, b, label, depth }, report) {
  const differs = !a || !b || a.outcome !== b.outcome || a.error !== b.error,
    // levels below the twelfth are not indented further, which keeps room for the names
    style = "padding-left: " + (0.4 + Math.min(depth, 12) * 0.8) + "em";
  return el.li(
    { class: differs ? "differs" : null },
    el("span.pair-name", { style }, label, differs && el("b.sign", { "aria-label": "differs" }, " ≠")),
    el("span.pair-track", bar(a, "a", report), bar(b, "b", report)),
  );
}

/** @returns the rows, and a function that marks a difference in the rows */
function goalRows(report) {
  const isTimed = report.unit === "s",
    marks = SIDES.map((side) => el("i", { class: "pair-mark " + side, hidden: true })),
    lengthText = (side) => (isTimed ? report.end[side].toFixed(1) + " s" : plural(report.end[side], "step"));
  const node = el(
    "div.pair",
    el(
      "p.dim.pair-legend",
      "Each goal has two bars: A above, B below. ",
      "A took " + lengthText("a") + ", B " + lengthText("b") + ".",
    ),
    el("div.pair-marks", { "aria-hidden": "true" }, el.span(), el.span(marks)),
    el.ol(report.goals.map((row) => goalRow(row, report))),
    report.more_goals ? note("and " + plural(report.more_goals, "more goal")) : null,
  );
  function mark(context) {
    for (const [index, side] of SIDES.entries()) {
      const seconds = secondsOf(context?.[side]);
      marks[index].hidden = seconds === undefined || !isTimed;
      marks[index].style.left = (100 * (seconds || 0)) / longestOf(report) + "%";
    }
  }
  return { node, mark };
}

// -- one difference at a time

function differenceBox(number, report) {
  const difference = report.differences[number],
    { subject, what } = difference,
    context = report.contexts[number];
  const moment = (side) => {
    const seconds = secondsOf(context?.[side]);
    return seconds !== undefined && momentLink(report, side, seconds, { class: "dim" }, "at ");
  };
  return [
    el.p(sign(difference), subject ? el.b(" " + shortened(subject) + ":") : null, " " + what),
    sides((side) => [el("p.code", eventText(difference[side])), moment(side)]),
    context
      ? [
          el.h3("What led to it, step by step"),
          surroundings(number, report),
          el.h3("Rules that fired just before"),
          sides((side) => rules(context[side].rules)),
        ]
      : note("The page has the steps that led to the first " + report.contexts.length + " differences."),
  ];
}

/** Show the differences one by one. @param mark marks the shown difference in the rows of goals */
function walk(report, mark) {
  const box = el.div({ "aria-live": "polite" }),
    title = el("h2#first"),
    { differences } = report;
  let shownNumber = 0;
  const arrow = (text, by, label) => button(text, () => show(shownNumber + by), { "aria-label": label }),
    back = arrow("◂", -1, "the previous difference"),
    next = arrow("▸", 1, "the next difference");
  function show(number) {
    shownNumber = number;
    title.textContent = number ? "Difference " + (number + 1) + " of " + report.total : "Where they part";
    back.disabled = number === 0;
    next.disabled = number === differences.length - 1;
    refill(box, differenceBox(number, report));
    mark(report.contexts[number]);
  }
  show(0);
  const rows = differences.slice(0, MOST_LISTED).map((difference, number) => {
    const choose = () => {
      show(number);
      title.scrollIntoView({ block: "center" });
    };
    const { subject, what } = difference,
      text = (subject ? shortened(subject) + ": " : "") + what;
    return [
      sign(difference),
      button(text, choose, { class: "quiet link" }),
      ...SIDES.map((side) => eventText(difference[side])),
    ];
  });
  const unlistedCount = report.total - rows.length,
    isMany = differences.length > 1,
    table = isMany && wideTable({}, ["", "what", "A", "B"], rows);
  return [
    el.section({ "aria-labelledby": "first" }, el("div.walk", title, isMany && [back, next]), box),
    isMany &&
      section("all", "All differences", table, unlistedCount > 0 && note("and " + unlistedCount + " more")),
  ];
}

/** The sentence about the first difference: where the runs part. */
function parting({ contexts: [context], unit, differences: [{ a, b }] }) {
  const moments = SIDES.map((side) => [secondsOf(context?.[side]), side.toUpperCase()])
    .filter(([seconds]) => seconds !== undefined && unit === "s")
    .map(([seconds, name]) => secondsText(seconds) + " in " + name);
  const where = moments.length ? " at " + moments.join(", ") : "";
  return el.p(
    "They part" + where + ": A has ",
    el.code(shortened(a.text)),
    ", B has ",
    el.code(shortened(b.text)),
    ".",
  );
}

export function open(main, report) {
  const { same, summary, options, headlines, differences } = report,
    setOptions = Object.entries(options).filter(([, value]) => value && value.length !== 0),
    { node, mark } = goalRows(report);
  const run = (side) => [
    linkTo(addressOf(report, side, "timeline"), { title: "open this run" }, report[side].path),
    headlines && dim(" " + headlines[side]),
  ];
  main.append(
    el(
      "div.comparison",
      el.div(
        { class: "verdict " + (same ? "same" : "differ") },
        el.p(el.i({ "aria-hidden": "true" }, same ? "=" : "≠"), summary),
        differences.length > 0 && !same && parting(report),
      ),
      pairs([["A", run("a")], ["B", run("b")], ...setOptions.map(([name, value]) => [name, String(value)])]),
      notes([...report.hints, ...report.notes]),
      report.goals.length > 0 && section("goals", "Goals of both runs", node),
      differences.length > 0 && walk(report, mark),
    ),
  );
}
