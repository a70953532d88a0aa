// Lanes over time: what each one did, as bars with words.
import { el, svg } from "cx/dom.js";

const ROW = 22,
  BAR = 16,
  HEAD = 22,
  LABELS = 150,
  NARROWEST = 900,
  WIDEST = 12000,
  PIXELS_A_SECOND = 6,
  LETTER = 6.6, // pixels
  TICK_PIXELS = 100;
const TICK_S = [10, 30, 60, 120, 300, 600];

const middleOf = (place) => HEAD + ROW * place + ROW / 2;

/** As much of a text as there is room for; nothing when that would mean nothing. */
function cut(text, pixels) {
  const letters = Math.floor(pixels / LETTER);
  if (text.length <= letters) return text;
  return letters > 3 ? text.slice(0, letters - 1) + "…" : "";
}

/** Seconds to the right: where a time is, and lines with numbers. */
export function axis(seconds, left, width) {
  const x = (time) => left + (width * time) / seconds;
  const number = (time) => (Math.abs(time) < 1000 ? String(Number(time.toPrecision(3))) : time.toFixed(0));
  const ticks = (times, top, bottom) =>
    times.map((time) => [
      svg("line.tick", { x1: x(time), x2: x(time), y1: top, y2: bottom }),
      svg.text({ x: x(time), y: 12, "text-anchor": time >= seconds ? "end" : "start" }, number(time) + " s"),
    ]);
  return { x, ticks, seconds, left, width };
}

function tickTimes({ seconds, width }) {
  const room = (seconds * TICK_PIXELS) / width,
    step = TICK_S.find((each) => each >= room) || Math.ceil(room);
  return Array.from({ length: Math.floor(seconds / step) + 1 }, (_, at) => at * step);
}

function bar({ begin, end, tone, text, title, mark = "" }, middle, { x, seconds }) {
  const left = x(Math.max(begin, 0)),
    width = Math.max(x(Math.min(end, seconds)) - left, 1),
    shown = cut(text, width - 4) || mark;
  return svg.g(
    { class: "t-" + tone },
    svg.title(title),
    svg.rect({ class: "t-" + tone, x: left, y: middle - BAR / 2, width, height: BAR, rx: 2 }),
    shown ? svg("text.word", { x: left + 3, y: middle + 4 }, shown) : null,
  );
}

function point({ at, tone, icon, title }, middle, { x, seconds }) {
  const place = x(Math.min(Math.max(at, 0), seconds));
  return svg.g(
    svg.title(title),
    svg.circle({ class: "point t-" + tone, cx: place, cy: middle, r: 8 }),
    svg("text.word", { x: place, y: middle + 4, "text-anchor": "middle" }, icon),
  );
}

const label = ({ label: text, lanes }, place) =>
  svg.text(
    { class: lanes ? "group" : null, x: 2, y: middleOf(place) + 4 },
    svg.title(text),
    cut(text, LABELS),
  );

function row({ bars = [], points = [] }, place, along) {
  const middle = middleOf(place),
    y = middle + ROW / 2;
  return [
    svg("line.row", { x1: along.left, x2: along.left + along.width, y1: y, y2: y }),
    bars.filter(({ begin }) => begin < along.seconds).map((each) => bar(each, middle, along)),
    points.map((each) => point(each, middle, along)),
  ];
}

/**
 * Draw lanes.
 * @param groups [{label, lanes: [{label, bars, points}]}]
 * @param length seconds; bars end there
 * @param about a description for screen readers
 */
export function lanes(groups, length, about) {
  const seconds = length > 0 ? length : 1,
    width = Math.min(Math.max(NARROWEST, seconds * PIXELS_A_SECOND), WIDEST),
    along = axis(seconds, 4, width - 8),
    rows = groups.flatMap((group) => (group.lanes.length ? [group, ...group.lanes] : [])),
    height = HEAD + ROW * rows.length + 4;
  return el(
    "div.lanes",
    svg.svg({ width: LABELS, height, "aria-hidden": "true" }, rows.map(label)),
    el(
      "div.wide",
      { tabindex: 0, role: "region", "aria-label": about },
      svg.svg(
        { width, height, role: "img", "aria-label": about },
        along.ticks(tickTimes(along), HEAD - 4, height),
        rows.map((each, place) => row(each, place, along)),
      ),
    ),
  );
}
