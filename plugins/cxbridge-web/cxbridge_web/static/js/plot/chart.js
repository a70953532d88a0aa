// A line chart over time on a canvas: several series, an axis for each unit, zoom and pan.
import { Canvas, dashOf, dot, drawingKeys, fillBox, gestures, ink, line, niceStep } from "cx/canvas.js";
import { el } from "cx/dom.js";
import { decimate, numberText } from "cx/plot/series.js";

const AXIS = 58, // pixels: the width of an axis with numbers
  WORDS_AXIS = 150, // the width of an axis with words
  WIDE = 800, // the width of a chart that has room for axes with words
  BOTTOM = 26, // the height of the axis of time
  TOP = 10, // the margin above the plotted area
  RIGHT = 14, // the margin right of the plotted area and of the axes there
  PAD = 0.06, // the margin above and below the values, as a share of their range
  KEY_STEP = 0.02, // a key moves the cursor by this share of the visible time
  KEY_ZOOM = 1.25,
  SHORTEST_US = 1000; // the shortest visible time

export class Chart {
  /**
   * All times are microseconds.
   * @param handlers.moved() is called after a pan; handlers.zoomed() after a zoom; handlers.cursor(time)
   * after each move of the cursor, with null when the pointer leaves; handlers.pick(time) when the user
   * chooses a moment; handlers.all() shows the whole run
   * @param timeText(time, step) returns the text of a time on the axis, with `step` between its marks
   */
  constructor(handlers, timeText) {
    // from, to: the visible times; zero: the time 0 of the axis; end: the end of the run
    Object.assign(this, { handlers, timeText, series: [], from: 0, to: 1, zero: 0, end: 0 });
    Object.assign(this, { cursor: null, moment: null, axes: [], left: AXIS, right: RIGHT });
    this.canvas = new Canvas((...args) => this.paint(...args));
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
      pan: (dx) => this.move((-dx * this.span) / this.plotWidth),
      zoom: (factor, x) => this.zoom(factor, this.timeAt(x)),
      point: (x) => this.point(this.timeAt(x)),
      leave: () => this.point(null),
      press: (x) => handlers.pick(this.timeAt(x)),
    });
    this.canvas.node.addEventListener("dblclick", () => handlers.all());
    const step = (direction) => (event) => this.step(direction, event.shiftKey),
      zoomIn = () => this.zoom(KEY_ZOOM, this.cursor ?? undefined);
    drawingKeys(this.box, {
      ArrowLeft: step(-1),
      ArrowRight: step(1),
      "+": zoomIn,
      "=": zoomIn,
      "-": () => this.zoom(1 / KEY_ZOOM, this.cursor ?? undefined),
      0: () => handlers.all(),
      Enter: () => this.cursor === null || handlers.pick(this.cursor),
    });
  }

  get span() {
    return this.to - this.from;
  }
  /** The width of the plotted area, without the axes. */
  get plotWidth() {
    return Math.max(1, this.canvas.width - this.left - this.right);
  }
  timeAt(x) {
    return this.from + ((x - this.left) / this.plotWidth) * this.span;
  }
  xOf(time) {
    return this.left + ((time - this.from) / this.span) * this.plotWidth;
  }

  show(series) {
    this.series = series;
    this.canvas.later();
  }
  /** Show a time span. */
  look(from, to) {
    this.from = from;
    this.to = Math.max(to, from + SHORTEST_US);
    this.canvas.later();
  }
  /** Set the cursor; null: no cursor. */
  point(time) {
    this.cursor = time;
    this.handlers.cursor(time);
    this.canvas.later();
  }
  /** Mark the chosen moment; null: none. */
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
    this.handlers.zoomed();
  }
  /** Move the cursor, or pan five times as far. @param direction -1 or 1 */
  step(direction, isPanning) {
    const step = direction * this.span * KEY_STEP,
      previous = this.cursor ?? this.moment ?? (this.from + this.to) / 2;
    if (isPanning) this.move(step * 5);
    else this.point(Math.min(this.to, Math.max(this.from, previous + step)));
  }

  /**
   * Place an axis for each unit and for each series of words, in turn left and right of the plotted area. The
   * third and further axes need room; without room, `x` is null and the series are drawn without an axis.
   */
  layAxes(width) {
    const keyOf = ({ words, name, source }) => (words ? name : source.axis),
      groups = Map.groupBy(this.series, keyOf);
    let room = width > WIDE ? width / 2 : width / 3,
      left = 0,
      right = 0;
    this.axes = [...groups.values()].map((series, at) => {
      const [{ words }] = series,
        isLeft = at % 2 === 0,
        axisWidth = words && width > WIDE ? WORDS_AXIS : AXIS,
        hasRoom = at < 2 || room >= axisWidth,
        x = hasRoom ? (isLeft ? left : right) : null;
      if (hasRoom) {
        if (isLeft) left += axisWidth;
        else right += axisWidth;
        room -= axisWidth;
      }
      return { series, words, isLeft, axisWidth, x, ...this.rangeOf(series, words) };
    });
    this.left = Math.max(left, AXIS);
    this.right = right + RIGHT;
  }
  /** The values at the ends of an axis: the visible range of its series, or all words, and a margin. */
  rangeOf(series, words) {
    const ranges = series.map((each) => each.range(this.from, this.to)).filter(Boolean);
    let low = words ? 0 : Math.min(...ranges.map(([least]) => least)),
      high = words ? Math.max(1, words.length - 1) : Math.max(...ranges.map(([, greatest]) => greatest));
    if (!Number.isFinite(low) || !Number.isFinite(high)) [low, high] = [0, 1];
    // a constant value is in the middle of its axis
    if (low === high) [low, high] = [low - (Math.abs(low) || 1) * 0.5, high + (Math.abs(high) || 1) * 0.5];
    const pad = (high - low) * PAD;
    return { low: low - pad, high: high + pad };
  }

  paint(context, width, height, colours) {
    this.layAxes(width);
    const bottom = height - BOTTOM,
      right = width - this.right;
    fillBox(context, colours.back, 0, 0, width, height);
    this.paintTimes(context, bottom, right, colours);
    for (const axis of this.axes) this.paintAxis(context, axis, bottom, right, colours);
    context.save();
    context.beginPath();
    context.rect(this.left, TOP, right - this.left, bottom - TOP);
    ink(context, { stroke: colours.line });
    context.clip();
    for (const axis of this.axes)
      for (const series of axis.series) this.paintLine(context, series, axis, bottom, colours);
    this.paintMoment(context, this.moment, bottom, { stroke: colours.focus, dash: [5, 4] });
    this.paintMoment(context, this.cursor, bottom, { stroke: colours.dim });
    if (this.cursor !== null) for (const axis of this.axes) this.paintDots(context, axis, bottom, colours);
    context.restore();
  }

  yOf(axis, value, bottom) {
    return bottom - ((value - axis.low) / (axis.high - axis.low)) * (bottom - TOP);
  }

  /** Draw the axis of time, about 110 pixels between marks; texts that would be cut are left out. */
  paintTimes(context, bottom, right, colours) {
    const step = niceStep(this.span, (right - this.left) / 110);
    Object.assign(context, { textAlign: "center", textBaseline: "top" });
    for (let at = Math.ceil((this.from - this.zero) / step); at * step + this.zero <= this.to; at++) {
      const time = at * step + this.zero,
        x = this.xOf(time);
      this.paintMoment(context, time, bottom, { stroke: colours.line, alpha: 0.5 });
      context.fillStyle = colours.dim;
      if (x > this.left + 20 && x < right - 20) context.fillText(this.timeText(time, step), x, bottom + 7);
    }
  }
  /** Draw an upright line at a visible time. */
  paintMoment(context, time, bottom, look) {
    if (time === null || time < this.from || time > this.to) return;
    const x = this.xOf(time);
    line(
      context,
      [
        [x, TOP],
        [x, bottom],
      ],
      look,
    );
  }

  /** Draw the marks of an axis, about 46 pixels apart, or each word; the first axis also has lines. */
  paintAxis(context, axis, bottom, right, colours) {
    if (axis.x === null) return;
    const x = axis.isLeft ? this.left - axis.x - 6 : right + axis.x + 6,
      step = axis.words ? 1 : niceStep(axis.high - axis.low, (bottom - TOP) / 46),
      isAlone = axis.series.length === 1 && this.axes.length > 1; // the colour tells the axes apart
    Object.assign(context, { textAlign: axis.isLeft ? "right" : "left", textBaseline: "middle" });
    for (let value = Math.ceil(axis.low / step) * step; value <= axis.high; value += step) {
      const y = this.yOf(axis, value, bottom),
        rounded = Math.round(value / step) * step,
        text = axis.words ? axis.words[rounded] : markText(rounded, step);
      if (axis === this.axes[0])
        line(
          context,
          [
            [this.left, y],
            [right, y],
          ],
          { stroke: colours.line, alpha: 0.5 },
        );
      context.fillStyle = isAlone ? colours.series[axis.series[0].colourNumber] : colours.dim;
      if (text !== undefined) context.fillText(fitting(context, text, axis.axisWidth - 10), x, y);
    }
  }

  paintLine(context, series, axis, bottom, colours) {
    // the samples before and after the visible time, too: the line leads beyond the edges
    const begin = Math.max(0, series.at(this.from)),
      end = Math.min(series.count, series.after(this.to) + 1);
    if (end <= begin) return;
    const { times, values, isStep } = series;
    let lastY = NaN; // of the previous sample; NaN: none, or a gap
    const addPoint = (at) => {
      const x = this.xOf(times[at]),
        y = this.yOf(axis, values[at], bottom);
      if (isStep && !Number.isNaN(lastY)) context.lineTo(x, lastY);
      if (Number.isNaN(lastY)) context.moveTo(x, y);
      else if (!Number.isNaN(y)) context.lineTo(x, y);
      lastY = y;
    };
    context.beginPath();
    decimate(series, begin, end, Math.ceil(this.plotWidth), (time) => this.xOf(time) - this.left, addPoint);
    // the last value holds until the end of the run
    if (!Number.isNaN(lastY) && end === series.count)
      context.lineTo(this.xOf(Math.min(this.to, this.end)), lastY);
    context.lineJoin = "round";
    ink(context, {
      stroke: colours.series[series.colourNumber],
      dash: dashOf(series.colourNumber),
      width: 1.8,
    });
  }

  /** Draw a dot on each line at the cursor. */
  paintDots(context, axis, bottom, colours) {
    for (const series of axis.series) {
      const value = series.values[series.at(this.cursor)],
        fill = colours.series[series.colourNumber];
      if (Number.isFinite(value))
        dot(context, this.xOf(this.cursor), this.yOf(axis, value, bottom), 3.5, { fill });
    }
  }

  /** End all listening; called when the chart leaves the page. */
  gone() {
    this.canvas.gone();
  }
}

/** The text, cut to a width in pixels. */
function fitting(context, text, room) {
  if (context.measureText(text).width <= room) return text;
  let length = text.length - 1;
  while (length > 1 && context.measureText(text.slice(0, length) + "…").width > room) length -= 1;
  return text.slice(0, length) + "…";
}

/** The text of a mark on an axis, with the decimal digits that its step needs. */
function markText(value, step) {
  // 1e-9: a computed step may be slightly below a power of ten
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return Math.abs(value) >= 1e7 || digits > 5 ? numberText(value) : value.toFixed(digits);
}
