// A plan: a timeline, the state after each step, and why each step is there.
import { el, pairs, svg } from "cx/dom.js";
import { notes, section, table } from "cx/documents/parts.js";

const WIDTH = 1000,
  ROW = 22,
  LABEL = 300,
  MOST_ROWS = 500; // steps that are drawn and listed; a browser is slow with more

const code = (text, kind) => el.code({ class: kind }, text);
const spanOf = ({ start, duration }, at) =>
  start === null ? [at, at + 1] : [start, start + (duration || 0)];

function timeline(steps) {
  const spans = steps.map(spanOf),
    end = Math.max(1e-9, ...spans.map(([, done]) => done)),
    scale = (WIDTH - LABEL) / end,
    unit = steps.some(({ start }) => start !== null) ? "seconds" : "steps";
  const bars = steps.map(({ action, text }, at) => {
    const [begin, done] = spans[at],
      y = at * ROW;
    return [
      svg.line({ x1: 0, x2: WIDTH, y1: y + ROW, y2: y + ROW }),
      svg.text({ x: 4, y: y + ROW - 7 }, at + 1 + " " + action),
      svg.rect(
        {
          x: LABEL + begin * scale,
          y: y + 4,
          width: Math.max(2, (done - begin) * scale),
          height: ROW - 8,
          rx: 2,
        },
        svg.title(text),
      ),
    ];
  });
  return svg(
    "svg.plan",
    { viewBox: "0 0 " + WIDTH + " " + ROW * Math.max(1, steps.length), role: "img" },
    svg.title(steps.length + " actions in " + end + " " + unit),
    bars,
  );
}

const changes = (list) =>
  list.map(({ part, added, deleted, numbers }) =>
    el(
      "p.plain",
      part ? part + ": " : null,
      added.map((fact) => [code(fact, "added"), " "]),
      deleted.map((fact) => [code(fact, "deleted"), " "]),
      numbers.map((fact) => [code(fact), " "]),
    ),
  );

function serves(found, steps) {
  if (!found.length) return "no step and no goal needs its effects";
  return el.ul(
    found.map(({ step, facts }) => {
      const known = steps[step - 1],
        name = step === 0 ? "the goal" : "step " + step + (known ? " (" + known.action + ")" : "");
      return el.li(name + " needs ", code(facts.join(", ")));
    }),
  );
}

const state = (facts) =>
  el.details(
    el.summary(facts.length + " facts"),
    el(
      "p.plain",
      facts.map((fact) => [code(fact), " "]),
    ),
  );

function* sections({ steps, begin }) {
  const shown = steps.slice(0, MOST_ROWS),
    left = notes(
      shown.length < steps.length ? ["the first " + MOST_ROWS + " of " + steps.length + " steps"] : [],
    );
  yield section("timeline", "Timeline", left, timeline(shown));
  yield section(
    "steps",
    "Steps",
    el.h3("At the start"),
    state(begin),
    table(
      ["", "step", "changes", "why it is there", "state after it"],
      shown.map((step, at) => [
        at + 1,
        code(step.text),
        changes(step.changes),
        serves(step.serves, steps),
        step.after ? state(step.after) : "",
      ]),
      { numbers: [0], empty: "no steps" },
    ),
  );
}

/** Show a plan. */
export function open(main, report) {
  main.append(
    el(
      "div.document",
      pairs(Object.entries(report.facts)),
      report.reasons
        ? section("reasons", "Why there is no plan", el.ul(report.reasons.map((reason) => el.li(reason))))
        : [...sections(report)],
    ),
  );
}
