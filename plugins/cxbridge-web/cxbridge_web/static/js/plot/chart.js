// A line chart over time on a canvas: several series, an axis for each group of them, zoom and pan.
import { Canvas, niceStep } from "cx/canvas.js";
import { el } from "cx/dom.js";
import { gestures } from "cx/panzoom.js";
import { decimate, numberText } from "cx/plot/series.js";

const AXIS = 58,
  WORDS_AXIS = 150,
  WIDE = 800,
  BOTTOM = 26,
  TOP = 10,
  RIGHT = 14,
  PAD = 0.06,
  KEY_STEP = 0.02,
  KEY_ZOOM = 1.25,
  SHORTEST_US = 1000;
const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3]];
export const dashOf = (number) => DASHES[number % DASHES.length];

export class Chart {
  /**
   * @param handlers.moved() somebody zoomed or panned; handlers.cursor(time) the pointer is there, null: nowhere;
   * handlers.pick(time) that moment was chosen; handlers.all() show everything
   * @param timeText(time, step) a time on the axis, whose marks are `step` apart; microseconds
   */
  constructor(handlers, timeText) {
    Object.assign(this, { handlers, timeText, series: [], from: 0, to: 1, zero: 0, end: 0 });
    Object.assign(this, { cursor: null, moment: null, axes: [], margins: { left: AXIS, right: RIGHT } });
    this.canvas = new Canvas((...rest) => this.paint(...rest));
    this.box = el(
      "div.chart",
      {
        tabindex: 0,
        role: "application",
        "aria-roledescription": "chart",
        "aria-label": "Values over time; their numbers are in the table below",
        "aria-keyshortcuts": "ArrowLeft ArrowRight Plus Minus 0 Enter",
      },
      this.canvas.node,
    );
    gestures(this.canvas.node, {
      pan: (dx) => this.move((-dx * this.span) / this.wide),
      zoom: (factor, x) => this.zoom(factor, this.timeAt(x)),
      point: (x) => this.point(this.timeAt(x)),
      leave: () => this.point(null),
      press: (x) => handlers.pick(this.timeAt(x)),
    });
    this.canvas.node.addEventListener("dblclick", () => handlers.all());
    this.box.addEventListener("keydown", (event) => this.onKey(event));
  }

  get span() {
    return this.to - this.from;
  }
  get left() {
    return this.margins.left;
  }
  get right() {
    return this.margins.right;
  }
  get wide() {
    return Math.max(1, this.canvas.width - this.left - this.right);
  }
  timeAt(x) {
    return this.from + ((x - this.left) / this.wide) * this.span;
  }
  xOf(time) {
    return this.left + ((time - this.from) / this.span) * this.wide;
  }

  show(series) {
    this.series = series;
    this.canvas.later();
  }
  /** Show this part of time. */
  look(from, to) {
    this.from = from;
    this.to = Math.max(to, from + SHORTEST_US);
    this.canvas.later();
  }
  point(time) {
    this.cursor = time;
    this.handlers.cursor(time);
    this.canvas.later();
  }
  mark(time) {
    this.moment = time;
    this.canvas.later();
  }
  move(by) {
    this.look(this.from + by, this.to + by);
    this.handlers.moved();
  }
  zoom(factor, around = (this.from + this.to) / 2) {
    const span = Math.max(SHORTEST_US, this.span / factor),
      share = (around - this.from) / this.span;
    this.look(around - share * span, around + (1 - share) * span);
    this.handlers.moved();
  }

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = this.span * KEY_STEP,
      way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (way && event.shiftKey) this.move(way * step * 5);
    else if (way) {
      const before = this.cursor ?? this.moment ?? (this.from + this.to) / 2;
      this.point(Math.min(this.to, Math.max(this.from, before + way * step)));
    } else if (event.key === "+" || event.key === "=") this.zoom(KEY_ZOOM, this.cursor ?? undefined);
    else if (event.key === "-") this.zoom(1 / KEY_ZOOM, this.cursor ?? undefined);
    else if (event.key === "0") this.handlers.all();
    else if (event.key === "Enter" && this.cursor !== null) this.handlers.pick(this.cursor);
    else return;
    event.preventDefault();
    event.stopPropagation(); // numbers lead to other views
  }

  /** One axis for what has the same unit; what does not fit beside the chart has none. */
  layAxes(width) {
    const byKey = new Map();
    for (const each of this.series) {
      const key = each.words ? each.name : each.source.axis;
      if (!byKey.has(key)) byKey.set(key, { key, series: [], words: each.words });
      byKey.get(key).series.push(each);
    }
    this.axes = [...byKey.values()];
    let room = width > WIDE ? width / 2 : width / 3,
      left = 0,
      right = 0;
    this.axes.forEach((axis, at) => {
      axis.isLeft = at % 2 === 0;
      axis.wide = axis.words && width > WIDE ? WORDS_AXIS : AXIS;
      axis.x = null;
      if (at < 2 || room >= axis.wide) {
        axis.x = axis.isLeft ? left : right;
        if (axis.isLeft) left += axis.wide;
        else right += axis.wide;
        room -= axis.wide;
      }
      const ranges = axis.series.map((each) => each.range(this.from, this.to)).filter(Boolean);
      let low = axis.words ? 0 : Math.min(...ranges.map((range) => range[0])),
        high = axis.words ? Math.max(1, axis.words.length - 1) : Math.max(...ranges.map((range) => range[1]));
      if (!Number.isFinite(low) || !Number.isFinite(high)) [low, high] = [0, 1];
      if (low === high) [low, high] = [low - (Math.abs(low) || 1) * 0.5, high + (Math.abs(high) || 1) * 0.5];
      const pad = (high - low) * PAD;
      axis.low = low - pad;
      axis.high = high + pad;
    });
    this.margins = { left: Math.max(left, AXIS), right: right + RIGHT };
  }

  paint(context, width, height, colours) {
    this.layAxes(width);
    const bottom = height - BOTTOM,
      right = width - this.right;
    context.fillStyle = colours.back;
    context.fillRect(0, 0, width, height);
    context.lineWidth = 1;
    this.paintTimes(context, bottom, right, colours);
    for (const axis of this.axes) this.paintAxis(context, axis, bottom, right, colours);
    context.strokeStyle = colours.line;
    context.strokeRect(this.left, TOP, right - this.left, bottom - TOP);
    context.save();
    context.beginPath();
    context.rect(this.left, TOP, right - this.left, bottom - TOP);
    context.clip();
    for (const axis of this.axes)
      for (const each of axis.series) this.paintLine(context, each, axis, bottom, colours);
    this.paintMoment(context, this.moment, bottom, colours.focus, [5, 4]);
    this.paintMoment(context, this.cursor, bottom, colours.dim, []);
    if (this.cursor !== null) for (const axis of this.axes) this.paintDots(context, axis, bottom, colours);
    context.restore();
  }

  yOf(axis, value, bottom) {
    return bottom - ((value - axis.low) / (axis.high - axis.low)) * (bottom - TOP);
  }

  paintTimes(context, bottom, right, colours) {
    const step = niceStep(this.span, (right - this.left) / 110);
    context.textAlign = "center";
    context.textBaseline = "top";
    for (let at = Math.ceil((this.from - this.zero) / step); at * step + this.zero <= this.to; at++) {
      const time = at * step + this.zero;
      const x = this.xOf(time);
      context.strokeStyle = colours.line;
      context.globalAlpha = 0.5;
      context.beginPath();
      context.moveTo(x, TOP);
      context.lineTo(x, bottom);
      context.stroke();
      context.globalAlpha = 1;
      context.fillStyle = colours.dim;
      if (x > this.left + 20 && x < right - 20) context.fillText(this.timeText(time, step), x, bottom + 7);
    }
  }

  paintAxis(context, axis, bottom, right, colours) {
    if (axis.x === null) return;
    const x = axis.isLeft ? this.left - axis.x : right + axis.x,
      step = axis.words ? 1 : niceStep(axis.high - axis.low, (bottom - TOP) / 46),
      only = axis.series.length === 1;
    context.textAlign = axis.isLeft ? "right" : "left";
    context.textBaseline = "middle";
    for (let value = Math.ceil(axis.low / step) * step; value <= axis.high; value += step) {
      const y = this.yOf(axis, value, bottom);
      if (axis === this.axes[0]) {
        context.strokeStyle = colours.line;
        context.globalAlpha = 0.5;
        context.beginPath();
        context.moveTo(this.left, y);
        context.lineTo(right, y);
        context.stroke();
        context.globalAlpha = 1;
      }
      const rounded = Math.round(value / step) * step,
        text = axis.words ? axis.words[rounded] : tick(rounded, step);
      // an axis of one series has its colour
      context.fillStyle = only && this.axes.length > 1 ? colours.series[axis.series[0].number] : colours.dim;
      if (text !== undefined)
        context.fillText(fitting(context, text, axis.wide - 10), axis.isLeft ? x - 6 : x + 6, y);
    }
  }

  paintLine(context, series, axis, bottom, colours) {
    const from = Math.max(0, series.at(this.from)),
      to = Math.min(series.count, series.after(this.to) + 1);
    if (to <= from) return;
    const scale = this.wide / this.span,
      tall = (bottom - TOP) / (axis.high - axis.low),
      { times, values, isStep } = series;
    let last = NaN;
    context.beginPath();
    decimate(
      series,
      from,
      to,
      Math.ceil(this.wide),
      (time) => (time - this.from) * scale,
      (at) => {
        const x = this.left + (times[at] - this.from) * scale,
          y = bottom - (values[at] - axis.low) * tall;
        if (Number.isNaN(y)) {
          if (isStep && !Number.isNaN(last)) context.lineTo(x, last);
        } else if (Number.isNaN(last)) context.moveTo(x, y);
        else {
          if (isStep) context.lineTo(x, last);
          context.lineTo(x, y);
        }
        last = y;
      },
    );
    if (!Number.isNaN(last) && to === series.count)
      context.lineTo(this.xOf(Math.min(this.to, this.end)), last);
    context.strokeStyle = colours.series[series.number];
    context.setLineDash(dashOf(series.number));
    context.lineWidth = 1.8;
    context.lineJoin = "round";
    context.stroke();
    context.setLineDash([]);
    context.lineWidth = 1;
  }

  paintMoment(context, time, bottom, colour, dash) {
    if (time === null || time < this.from || time > this.to) return;
    context.strokeStyle = colour;
    context.setLineDash(dash);
    context.beginPath();
    context.moveTo(this.xOf(time), TOP);
    context.lineTo(this.xOf(time), bottom);
    context.stroke();
    context.setLineDash([]);
  }

  paintDots(context, axis, bottom, colours) {
    for (const each of axis.series) {
      const value = each.values[each.at(this.cursor)];
      if (!Number.isFinite(value)) continue;
      context.fillStyle = colours.series[each.number];
      context.beginPath();
      context.arc(this.xOf(this.cursor), this.yOf(axis, value, bottom), 3.5, 0, 7);
      context.fill();
    }
  }

  gone() {
    this.canvas.gone();
  }
}

/** As much of a text as there is room for. */
function fitting(context, text, room) {
  if (context.measureText(text).width <= room) return text;
  let length = text.length - 1;
  while (length > 1 && context.measureText(text.slice(0, length) + "…").width > room) length -= 1;
  return text.slice(0, length) + "…";
}

function tick(value, step) {
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return Math.abs(value) >= 1e7 || digits > 5 ? numberText(value) : value.toFixed(digits);
}
