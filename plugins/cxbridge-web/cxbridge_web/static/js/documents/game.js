// A game: points, robots, machines, orders.
import { badge, el, none, note, svg } from "cx/dom.js";
import { axis, lanes } from "cx/documents/lanes.js";
import { allBut1, show, table } from "cx/documents/parts.js";
import { OUTCOMES, skillOutcome } from "cx/outcome.js";

const kind = (name) => [OUTCOMES[name].tone, OUTCOMES[name].icon];
const OTHER = ["other", "?"],
  NOTHING = ["new", "○"],
  BUSY = kind("running"),
  FULL = ["bound", "◕"],
  WINDOW = ["planned", "◑"],
  DELIVERED = kind("completed"),
  LATE = kind("failed");
/** The states of machines: those of published ones, and those of the league. */
const MACHINES = {
  free: NOTHING,
  busy: BUSY,
  full: FULL,
  IDLE: NOTHING,
  PREPARED: ["chosen", "◔"],
  PROCESSING: BUSY,
  PROCESSED: ["planned", "◑"],
  "READY-AT-OUTPUT": FULL,
  "WAIT-IDLE": ["ended", "■"],
  DOWN: kind("rejected"),
  BROKEN: kind("failed"),
};
const WIDTH = 1100,
  HEIGHT = 220,
  HEAD = 22,
  RIGHT = 120,
  TICKS = 6;

const machineLook = (state) => (Object.hasOwn(MACHINES, state) ? MACHINES[state] : OTHER);
const times = ({ begin, end }) =>
  begin.toFixed(1) + " to " + end.toFixed(1) + " s (" + (end - begin).toFixed(1) + " s)";
const inTime = ({ begin, end }, at) => begin <= at && at <= end;
const signed = (points) => (points > 0 ? "+" : "") + points;

/** A skill without the names of its parameters: `moveto C-BS`. */
function short(skill) {
  const [name] = /^[\w.-]+/.exec(skill) || [],
    values = [...skill.matchAll(/=\s*(?:"([^"]*)"|([^\s,}"]+))/g)].map(([, text, word]) => text ?? word);
  return name ? [name, ...values].join(" ") : skill;
}

function team([name, awards], at, along, height) {
  let sum = 0,
    path = "M" + along.left + " " + height(0);
  const dots = awards.map(({ points, second, game_time: time, reason }) => {
    sum += points;
    path += " H" + along.x(second) + " V" + height(sum);
    return svg.g(
      svg.title(time + " s: " + signed(points) + " " + reason),
      svg.circle({ class: "team" + at, cx: along.x(second), cy: height(sum), r: 3 }),
    );
  });
  const right = along.left + along.width;
  return [
    svg.path({ class: "team" + at, d: path + " H" + right }),
    dots,
    svg.text({ x: right + 6, y: height(sum) + 4 }, name + " " + sum),
  ];
}

function pointsOver({ awards, points, seconds }) {
  if (!awards.length) return none("no points");
  const along = axis(seconds > 0 ? seconds : 1, 4, WIDTH - RIGHT),
    sums = {},
    reached = awards.map((award) => (sums[award.team] = (sums[award.team] || 0) + award.points)),
    low = Math.min(0, ...reached),
    scale = (HEIGHT - HEAD - 10) / (Math.max(0, ...reached) - low || 1),
    height = (value) => HEIGHT - 4 - (value - low) * scale,
    teams = Object.keys(points)
      .map((name) => [name, awards.filter((award) => award.team === name && award.points)])
      .filter(([, own]) => own.length),
    parts = Array.from({ length: TICKS + 1 }, (_, at) => (along.seconds * at) / TICKS);
  const about = {
    viewBox: "0 0 " + WIDTH + " " + (HEIGHT + 4),
    role: "img",
    "aria-label": "Points over time; the table of points below has the same",
  };
  return el(
    "div.wide",
    svg(
      "svg.points",
      about,
      along.ticks(parts, HEAD - 4, HEIGHT),
      teams.map((each, at) => team(each, at % 2, along, height)),
    ),
  );
}

const skillBars = (spans, seconds) =>
  spans
    .map((span) => ({ ...span, begin: Math.max(0, span.begin), end: Math.min(seconds, span.end) }))
    .filter(({ begin, end }) => begin < end)
    .map((span) => {
      const outcome = skillOutcome(span.status),
        [tone, icon] = kind(outcome),
        mark = outcome === "failed" ? icon : "",
        why = span.error ? ": " + span.error : "",
        title = span.text + "\n" + span.status + why + "\n" + times(span);
      return { ...span, tone, mark, text: (mark + " " + short(span.text)).trim(), title };
    });

const stateBars = (spans) =>
  spans
    .filter(({ text }) => machineLook(text) !== NOTHING)
    .map((span) => ({ ...span, tone: machineLook(span.text)[0], title: span.text + "\n" + times(span) }));

function orderLane(order) {
  const { begin, end, complexity, delivered } = order,
    window = begin + " to " + end + " s";
  const point = (at) => {
    const [tone, icon] = inTime(order, at) ? DELIVERED : LATE;
    return { at, tone, icon, title: "delivered at " + at + " s; time: " + window };
  };
  return {
    label: order.order + ": " + complexity,
    bars: [{ begin, end, tone: WINDOW[0], text: complexity, title: complexity + ": " + window }],
    points: delivered.map(point),
  };
}

function legend({ skills, states }) {
  const names = (spans, key) => [
      ...new Set(
        Object.values(spans)
          .flat()
          .map((span) => span[key]),
      ),
    ],
    items = [
      ...names(skills, "status")
        .sort()
        .map((status) => [kind(skillOutcome(status)), "skill " + status]),
      ...names(states, "text").map((state) => [machineLook(state), "machine " + state]),
      [WINDOW, "time of delivery"],
      [DELIVERED, "delivered in time"],
      [LATE, "delivered at another time"],
    ];
  const badges = items.map(([look, text]) => [badge(...look, text), " "]);
  return el("p.legend", { "aria-label": "Legend" }, badges);
}

function timeline(report) {
  const { skills, states, orders, seconds } = report,
    machines = Object.keys(states),
    still = machines.filter((name) => states[name].length < 2 && !(name in skills)).sort(),
    skillLane = (name, label = name) => ({ label, bars: skillBars(skills[name], seconds) }),
    machineLanes = (name) => [
      { label: name, bars: stateBars(states[name]) },
      ...(name in skills ? [skillLane(name, name + ": skills")] : []),
    ];
  const robots = Object.keys(skills).filter((name) => !(name in states)),
    busy = machines.filter((name) => !still.includes(name)),
    groups = [
      { label: "Robots", lanes: robots.map((name) => skillLane(name)) },
      { label: "Machines", lanes: busy.flatMap(machineLanes) },
      { label: "Orders", lanes: orders.map(orderLane) },
    ];
  return [
    legend(report),
    lanes(groups, seconds, "What robots, machines and orders did when; the tables below sum it up"),
    note(
      "Seconds of the production. ",
      still.length ? "Machines that did nothing: " + still.join(", ") + ". " : "",
      "Point at a bar to see more.",
    ),
  ];
}

const categories = ({ categories: found }) =>
  table(
    ["team", "category", "points"],
    Object.entries(found).flatMap(([name, of]) =>
      Object.entries(of)
        .sort(([, one], [, other]) => other - one)
        .map((entry) => [name, ...entry]),
    ),
    { numbers: [2], empty: "no points" },
  );

function robotsOf({ robots, skills }) {
  const rows = Object.entries(robots).map(([name, { busy_seconds: busy, idle_seconds: idle, failed }]) => [
    ...[name, busy.toFixed(1), idle.toFixed(1), (skills[name] || []).length],
    Object.entries(failed)
      .map(([error, count]) => count + " times: " + error)
      .join("; "),
  ]);
  const heads = ["name", "busy, s", "idle, s", "skills", "failed"];
  return table(heads, rows, { numbers: [1, 2, 3], empty: "no robot has executed a skill" });
}

function machinesOf({ machines }) {
  const states = [...new Set(Object.values(machines).flatMap((seconds) => Object.keys(seconds)))],
    heads = ["seconds in the state", ...states],
    rows = Object.entries(machines).map(([name, seconds]) => [
      name,
      ...states.map((state) => seconds[state]?.toFixed(1) ?? ""),
    ]);
  return table(heads, rows, { numbers: allBut1(heads), empty: "no machine has told its state" });
}

function ordersOf({ orders }) {
  const rows = orders.map((order) => [
    ...[order.order, order.complexity, order.begin, order.end],
    order.delivered.map((at) => at + (inTime(order, at) ? "" : " (not in time)")).join(", ") || "-",
  ]);
  const heads = ["order", "what", "from, s", "until, s", "delivered, s"];
  return table(heads, rows, { numbers: [0, 2, 3], empty: "no orders" });
}

const awardsOf = ({ awards }) =>
  table(
    ["s", "phase", "team", "points", "reason"],
    awards.map(({ game_time: time, phase, team: name, points, reason }) => [
      ...[time.toFixed(1), phase, name, (points < 0 ? "" : "+") + points, reason],
    ]),
    { numbers: [0, 3], empty: "no points" },
  );

export function open(main, report) {
  const points = Object.entries(report.points).map((entry) => entry.join(" ")),
    ended = report.complete ? "over" : "not over, in " + report.phase,
    tests = report.simtest ? "; the agent's own tests: " + report.simtest : "",
    verdict =
      `${points.join(", ")} points; ${report.deliveries.length} deliveries; ` +
      `the game is ${ended} after ${report.game_time} s${tests}`,
    { command, faults } = report;
  show(main, { verdict, command, notes: [...faults, ...report.undefined] }, [
    ["points", "Points over time", pointsOver(report)],
    ["categories", "What the points are for", categories(report)],
    ["timeline", "Timeline", timeline(report)],
    ["robots", "Robots", robotsOf(report)],
    ["machines", "Machines", machinesOf(report)],
    ["orders", "Orders", ordersOf(report)],
    ["awards", "Each award", awardsOf(report)],
  ]);
}
