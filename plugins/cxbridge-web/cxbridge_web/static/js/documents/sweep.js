// A sweep of one agent, or of two on the same seeds: outcomes, durations, goals, and the seeds to look at.
import { svg } from "cx/dom.js";
import { allBut1, notes, show, table } from "cx/documents/parts.js";

const BINS = 40,
  WIDTH = 720,
  HEIGHT = 180,
  FOOT = 18;

function histogram(values, label) {
  const low = Math.min(...values),
    high = Math.max(...values),
    width = (high - low) / BINS || 1,
    counts = Array(BINS).fill(0),
    step = WIDTH / BINS,
    y = HEIGHT + FOOT - 4;
  for (const value of values) counts[Math.min(Math.floor((value - low) / width), BINS - 1)] += 1;
  const top = Math.max(...counts);
  const bars = counts.map((count, at) => {
    const height = (HEIGHT * count) / top,
      from = low + at * width,
      title = from.toFixed(2) + " to " + (from + width).toFixed(2) + " s: " + count;
    return (
      count > 0 && svg.rect({ x: at * step, y: HEIGHT - height, width: step - 1, height }, svg.title(title))
    );
  });
  return svg(
    "svg.plot",
    { role: "img", "aria-label": label, viewBox: "0 0 " + WIDTH + " " + (HEIGHT + FOOT) },
    bars,
    svg.text({ x: 0, y }, low.toFixed(2) + " s"),
    svg.text({ x: WIDTH, y, "text-anchor": "end" }, high.toFixed(2) + " s"),
  );
}

const percent = (part) => (100 * part).toFixed(2) + " %";
function outcomes([name, { runs, outcomes: found, seeds }]) {
  const rows = Object.entries(found).map(([outcome, count]) => [
    ...[outcome, count, percent(count / runs)],
    (seeds[outcome] || []).join(", "),
  ]);
  const caption = name + ": " + runs + " runs";
  return table(["outcome", "runs", "share", "first seeds"], rows, { numbers: [1, 2], caption });
}

function makespan([name, { makespan: found, makespans }]) {
  if (!found) return notes([name + ": no run was completed."]);
  const values = Object.values(found).map((value) => value.toFixed(2));
  return [
    table(Object.keys(found), [values], { numbers: [...values.keys()], caption: name + ": seconds" }),
    histogram(makespans, "Makespan of " + name),
  ];
}

function goals([name, { goals: found }]) {
  const ends = [...new Set(Object.values(found).flatMap((counts) => Object.keys(counts)))].sort(),
    rows = Object.entries(found).map(([kind, counts]) => [kind, ...ends.map((end) => counts[end] || 0)]),
    heads = ["class", ...ends];
  return table(heads, rows, { numbers: allBut1(heads), caption: name, empty: "no goals" });
}

const signed = (value, scale) => (value < 0 ? "" : "+") + Number((value * scale).toPrecision(3));
function difference(what, { estimate, low, high }, scale, unit) {
  const known = low !== null && high !== null,
    span = known ? signed(low, scale) + " to " + signed(high, scale) + " " + unit : "too few for an interval",
    differs = known && (low > 0 || high < 0);
  return [what, signed(estimate, scale) + " " + unit, span, differs ? "differ" : "no difference is seen"];
}

function comparison({ completed, makespan: took, seeds }) {
  const rows = [difference("completed runs, difference", completed, 100, "%")];
  if (took) rows.push(difference("makespan, difference", took, 1, "s"));
  const farthest = seeds.map(({ seed, outcomes: ends, makespans }) => [
    seed,
    ...ends,
    ...makespans.map((seconds) => seconds.toFixed(2)),
  ]);
  return [
    table(["second minus first", "estimate", "95 % interval", "verdict"], rows, { numbers: [1, 2] }),
    table(["seed", "first", "second", "first, s", "second, s"], farthest, {
      numbers: [0, 3, 4],
      caption: "Seeds in which they differ most",
    }),
  ];
}

export function open(main, { command, comparison: compared, sweeps: found }) {
  const sweeps = Object.entries(found);
  show(main, { command }, [
    compared && ["comparison", "Comparison", comparison(compared)],
    ["outcomes", "Outcomes", sweeps.map(outcomes)],
    ["makespan", "Makespan", sweeps.map(makespan)],
    ["goals", "Goals", sweeps.map(goals)],
  ]);
}
