// Lanes over time: what each one did, as bars with words.
import { el, svg } from "cx/dom.js";

const ROW = 22,
  BAR = 16,
  HEAD = 22,
  LABELS = 150,
  NARROWEST = 500,
  WIDEST = 12000,
  COLUMN = 1150, // the width of a document's text
  MARGINS = 64,
  PIXELS_A_SECOND = 6,
  LETTER = 6.6, // pixels
  TICK_PIXELS = 100;
const TICKS = [1, 2, 5, 10, 30, 60, 120, 300, 600];

const middleOf = (place) => HEAD + ROW * place + ROW / 2;

/** A text cut to a width; "" for less than four letters. */
function cut(text, pixels) {
  const letters = Math.floor(pixels / LETTER);
  if (text.length <= letters) return text;
  return letters > 3 ? text.slice(0, letters - 1) + "…" : "";
}

/** Seconds to the right: where a time is, and lines with numbers. */
export function axis(seconds, left, width, unit = " s") {
  const x = (time) => left + (width * time) / seconds,
    number = (time) => (Math.abs(time) < 1000 ? String(Number(time.toPrecision(3))) : time.toFixed(0)),
    anchor = (time) => (time >= seconds ? "end" : "start");
  const ticks = (times, top, bottom) =>
    times.map((time) => [
      svg("line.tick", { x1: x(time), x2: x(time), y1: top, y2: bottom }),
      svg.text({ x: x(time), y: 12, "text-anchor": anchor(time) }, number(time) + unit),
    ]);
  return { x, ticks, seconds, left, width };
}

function tickTimes({ seconds, width }) {
  const room = (seconds * TICK_PIXELS) / width,
    step = TICKS.find((each) => each >= room) || Math.ceil(room);
  return Array.from({ length: Math.floor(seconds / step) + 1 }, (_, at) => at * step);
}

/** @param of {begin, end, tone or kind: a class, text, title, mark, href, from: the lane that a line comes from} */
function bar({ begin, end, tone, kind = "t-" + tone, text = "", title, mark = "", ...of }, middle, along) {
  const { x, seconds } = along,
    left = x(Math.max(begin, 0)),
    width = Math.max(x(Math.min(end, seconds)) - left, 1),
    shown = cut(text, width - 4) || mark,
    attributes = { href: of.href, "aria-label": of.href && title };
  return svg(
    of.href ? "a" : "g",
    of.href ? attributes : { class: kind },
    svg.title(title),
    of.from >= 0 && svg.path({ d: "M" + left + " " + middleOf(of.from) + " V" + middle }),
    svg.rect({ class: kind, x: left, y: middle - BAR / 2, width, height: BAR, rx: 2 }),
    shown && svg("text.word", { x: left + 3, y: middle + 4 }, shown),
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
 * @param groups [{label, lanes: [{label, bars, points}]}]; a group without label has no line of its own
 * @param length seconds; bars end there
 * @param about a description for screen readers
 * @param how labels: the width of labels; kind: a class; unit of the axis
 */
export function lanes(groups, length, about, { labels = LABELS, kind = "", unit = " s" } = {}) {
  const seconds = length > 0 ? length : 1,
    headed = groups.filter((group) => group.lanes.length),
    rows = headed.flatMap((group) => [...(group.label ? [group] : []), ...group.lanes]),
    longest = Math.max(0, ...rows.map(({ label: { length: letters } }) => letters)),
    beside = Math.min(labels, Math.ceil((longest + 2) * LETTER)),
    room = Math.min(innerWidth - MARGINS, COLUMN) - beside,
    width = Math.min(Math.max(NARROWEST, room, seconds * PIXELS_A_SECOND), WIDEST),
    along = axis(seconds, 4, width - 8, unit),
    height = HEAD + ROW * rows.length + 4,
    hasLinks = rows.some(({ bars = [] }) => bars.some(({ href }) => href));
  const label = ({ label: text, lanes: isGroup, kind: own = null }, place) =>
    svg.text(
      { class: isGroup ? "group" : own, x: 2, y: middleOf(place) + 4 },
      svg.title(text),
      cut(text, beside),
    );
  return el.div(
    { class: ("lanes " + kind).trim() },
    svg.svg({ width: beside, height, "aria-hidden": "true" }, rows.map(label)),
    el(
      "div.wide",
      { tabindex: 0, role: "region", "aria-label": about },
      svg.svg(
        { width, height, role: hasLinks ? "group" : "img", "aria-label": about }, // links in an image are not reached
        along.ticks(tickTimes(along), HEAD - 4, height),
        rows.map((each, place) => row(each, place, along)),
      ),
    ),
  );
}
