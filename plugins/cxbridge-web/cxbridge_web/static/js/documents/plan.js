// A plan: a timeline, the state after each step, and why each step is there.
import { el, pairs } from "cx/dom.js";
import { lanes } from "cx/documents/lanes.js";
import { list, notes, show, table } from "cx/documents/parts.js";

const MOST_ROWS = 500, // steps that are drawn and listed; a browser is slow with more
  LABELS = 300;

const code = (text, kind) => el.code({ class: kind }, text);
const codes = (facts, kind) => facts.map((fact) => [code(fact, kind), " "]);

function timeline(steps) {
  const isTimed = steps.some(({ start }) => start !== null),
    spanOf = ({ start, duration }, at) => (start === null ? [at, at + 1] : [start, start + (duration || 0)]);
  const rows = steps.map((step, at) => {
    const [begin, end] = spanOf(step, at);
    return { label: at + 1 + " " + step.action, bars: [{ begin, end, tone: "active", title: step.text }] };
  });
  const length = Math.max(1e-9, ...rows.map(({ bars: [{ end }] }) => end)),
    about = steps.length + " actions in " + length + (isTimed ? " seconds" : " steps");
  return lanes([{ lanes: rows }], length, about, { labels: LABELS, unit: isTimed ? " s" : "" });
}

const changes = (parts) =>
  parts.map(({ part, added, deleted, numbers }) =>
    el("p.plain", part && part + ": ", codes(added, "added"), codes(deleted, "deleted"), codes(numbers)),
  );

function serves(found, steps) {
  if (!found.length) return "no step and no goal needs its effects";
  return list(found, ({ step, facts }) => {
    const known = steps[step - 1],
      name = step === 0 ? "the goal" : "step " + step + (known ? " (" + known.action + ")" : "");
    return [name + " needs ", code(facts.join(", "))];
  });
}

const state = (facts) => el.details(el.summary(facts.length + " facts"), el("p.plain", codes(facts)));

function stepsOf({ steps, begin }, shown) {
  const rows = shown.map((step, at) => [
    at + 1,
    code(step.text),
    changes(step.changes),
    serves(step.serves, steps),
    step.after ? state(step.after) : "",
  ]);
  const heads = ["", "step", "changes", "why it is there", "state after it"];
  return [el.h3("At the start"), state(begin), table(heads, rows, { numbers: [0], empty: "no steps" })];
}

export function open(main, report) {
  const { facts, reasons, steps } = report,
    shown = steps?.slice(0, MOST_ROWS) ?? [],
    left =
      reasons || shown.length === steps.length ? [] : [`the first ${MOST_ROWS} of ${steps.length} steps`];
  show(
    main,
    { verdict: pairs(Object.entries(facts)) },
    reasons
      ? [["reasons", "Why there is no plan", list(reasons)]]
      : [
          ["timeline", "Timeline", [notes(left), timeline(shown)]],
          ["steps", "Steps", stepsOf(report, shown)],
        ],
  );
}
