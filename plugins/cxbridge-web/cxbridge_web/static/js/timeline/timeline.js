// The timeline: goals, plan-actions, skill calls and errors over time. The page and reports show this component.
import { Detail } from "cx/detail.js";
import { el, none } from "cx/dom.js";
import { failureOf, lateAfter, longestOf } from "cx/story/causes.js";
import { VirtualList } from "cx/virtual.js";
import { findAt, tipOf } from "cx/timeline/find.js";
import { keyInput, pointerInput } from "cx/timeline/input.js";
import { nameOf, signOf } from "cx/timeline/labels.js";
import { Overview } from "cx/timeline/overview.js";
import { marksOf } from "cx/timeline/marks.js";
import { AXIS, MARKS, Painter } from "cx/timeline/paint.js";
import { pathTo, resolve } from "cx/timeline/path.js";
import { Rows } from "cx/timeline/rows.js";
import { timesOf } from "cx/timeline/spans.js";
import { palette } from "cx/timeline/palette.js";
import { Tip } from "cx/timeline/tip.js";
import { Toolbar } from "cx/timeline/toolbar.js";
import { TimeWindow } from "cx/timeline/window.js";

const LIVE_MS = 50,
  SETTLED_MS = 160,
  DOUBLE_MS = 300,
  LATE_MS = 500;

export class Timeline {
  /**
   * @param host see host.js
   * @param tools further elements of the bar
   */
  constructor(host, tools = []) {
    this.host = host;
    this.path = {};
    this.frame = 0;
    this.clickedAt = -Infinity;
    this.clicked = null; // the item of the last click
    this.shape = -1;
    this.rows = new Rows(host.history);
    this.window = new TimeWindow((axis) => this.range(axis));
    this.window.follows = host.isLive;
    this.build(tools);
    this.window.listeners.add(() => this.moved());
    pointerInput(this.canvas, this);
    keyInput(this.box, this);
    this.resized = new ResizeObserver(() => this.later());
    this.resized.observe(this.canvas);
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.recolour = () => {
      this.palette = null;
      this.later();
    };
    this.scheme.addEventListener("change", this.recolour);
    if (host.isLive) this.timer = setInterval(() => this.tick(), LIVE_MS);
    this.relist();
  }

  build(tools) {
    this.canvas = el("canvas.tl-chart", { "aria-hidden": "true" });
    const strip = el("canvas.tl-overview", { "aria-hidden": "true" });
    this.list = new VirtualList({
      label: "Goals over time",
      height: "--row-lane",
      key: (row) => row.key,
      sign: (row) => signOf(row, this.cursorStep),
      draw: (row) => nameOf(row, this.history, this.cursorStep),
      select: (row, how) => this.choose(row, how),
      open: (row, open) => {
        this.rows.folds.set(row.key, open);
        this.relist();
      },
    });
    this.list.box.classList.add("tl-names");
    this.list.box.addEventListener("scroll", () => this.later(), { passive: true });
    this.detail = new Detail(this.host, () => this.later());
    this.toolbar = new Toolbar(this, tools);
    this.tip = new Tip(this.canvas);
    this.empty = el("div.tl-empty", { hidden: true });
    this.body = el(
      "div.tl-body",
      el("div.tl-corner.dim", el.span("errors")),
      this.canvas,
      this.list.box,
      this.empty,
      this.tip.box,
    );
    this.main = el("div.tl-main", strip, this.body);
    this.box = el("div.tl", this.toolbar.box, el("div.tl-columns", this.main, this.detail.box));
    this.box.timeline = this; // for scripts that drive the page
    this.overview = new Overview(strip, this);
  }

  // -- what is shown

  get history() {
    return this.host.history;
  }
  get now() {
    return this.host.now();
  }
  get zero() {
    return this.host.zero;
  }
  range(axis) {
    if (axis === "step") return { from: 0, to: Math.max(1, this.history.steps) };
    const { history } = this,
      begin = history.begin ?? this.now.time,
      // when all is over, the picture does not go on to shrink
      isOver = this.host.isLive && history.steps > 0 && !history.goesOn,
      end = isOver ? history.stepTimes.at(-1) : this.now.time;
    return { from: begin, to: Math.max(end, begin + 1000) };
  }
  get cursorValue() {
    const at = this.host.cursor();
    return at ? at[this.window.axis] : null;
  }
  get cursorX() {
    const value = this.cursorValue,
      x = value === null ? -1 : this.window.x(value);
    return x >= 0 && x <= this.window.width ? x : this.window.width / 2;
  }
  get cursorStep() {
    const at = this.host.cursor();
    return at ? at.step : Infinity;
  }
  get marks() {
    return marksOf(this.history);
  }
  /** The skill calls that run for much longer than those before: looked for twice a second. */
  get late() {
    const at = performance.now();
    if (!this.lateAt || at - this.lateAt > LATE_MS) {
      this.lateAt = at;
      const open = this.history.calls.filter(({ end }) => !end),
        longest = open.length ? longestOf(this.history) : null,
        { time } = this.now;
      this.lateCalls = new Set(open.filter((call) => lateAfter(call, longest, time)));
    }
    return this.lateCalls;
  }
  /** What the painter and the search for what is below the pointer know. */
  get scene() {
    this.palette ||= palette(this.box);
    return {
      window: this.window,
      history: this.history,
      palette: this.palette,
      now: this.now,
      zero: this.zero,
      high: this.list.rowHeight,
      selected: this.list.selected,
      late: this.late,
      chosen: resolve(this.path, this.history).item,
      rows: this.list.items,
      marks: this.marks,
      scroll: this.list.box.scrollTop,
    };
  }

  // -- drawing

  later() {
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      this.draw();
    });
  }
  /** The data changed. */
  update() {
    if (this.history.shape !== this.shape || this.rows.filters) this.relist();
    else this.later();
    this.window.advance();
  }
  relist() {
    this.shape = this.history.shape;
    this.items = this.rows.list();
    this.isListDirty = true;
    this.later();
  }
  moved() {
    this.later();
    if (!this.rows.inSight) return;
    clearTimeout(this.settling);
    this.settling = setTimeout(() => this.relist(), SETTLED_MS);
  }
  tick() {
    if (document.hidden || !this.box.isConnected) return;
    const { time } = this.now;
    if (time === this.tickedAt) return;
    this.tickedAt = time;
    this.window.advance();
    this.later();
  }

  draw() {
    const width = this.canvas.clientWidth,
      height = this.canvas.clientHeight,
      ratio = Math.min(devicePixelRatio || 1, 3);
    if (!width || !height) return;
    if (this.window.width !== width) {
      this.window.width = width;
      if (this.window.fits) this.window.fit();
    }
    if (!this.isFitted) {
      this.isFitted = true;
      this.window.fit();
    }
    const isNewList = this.isListDirty;
    if (isNewList) {
      this.isListDirty = false;
      this.list.set(this.items);
      if (this.revealing) this.list.mark(this.list.selected, true);
      this.revealing = false;
      if (this.revealed > 0) this.list.reveal(this.revealed);
      this.revealed = 0;
    } else if (this.namesOf !== this.history.revision + " " + this.cursorStep) this.list.update();
    this.namesOf = this.history.revision + " " + this.cursorStep;
    if (this.canvas.width !== Math.round(width * ratio)) this.canvas.width = Math.round(width * ratio);
    if (this.canvas.height !== Math.round(height * ratio)) this.canvas.height = Math.round(height * ratio);
    this.paint(this.canvas.getContext("2d"), width, height, ratio);
    if (isNewList) {
      this.later(); // of thousands of rows all of it would be a long task
      return;
    }
    this.overview.draw();
    this.toolbar.draw();
    this.detail.draw(this.path);
    this.drawEmpty();
  }
  paint(context, width, height, ratio) {
    const { scene } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = scene.palette.back;
    context.fillRect(0, 0, width, height);
    const painter = new Painter(context, scene),
      { high, scroll, rows } = scene;
    painter.axis(height);
    painter.errors(scene.marks);
    context.save();
    context.beginPath();
    context.rect(0, AXIS + MARKS, width, height);
    context.clip();
    const first = Math.max(0, Math.floor(scroll / high)),
      end = Math.min(rows.length, Math.ceil((scroll + height) / high));
    for (let at = first; at < end; at++) painter.row(rows[at], AXIS + MARKS + at * high - scroll);
    context.restore();
    const { cursorValue } = this;
    if (cursorValue !== null) painter.cursor(cursorValue, height);
  }
  drawEmpty() {
    const isEmpty = !this.list.items.length;
    this.empty.hidden = !isEmpty;
    if (isEmpty)
      this.empty.replaceChildren(
        this.rows.filters
          ? none("No goal matches", "Other outcomes, or another search?")
          : none(
              "No goals yet",
              this.host.isLive ? "They appear here as soon as the executive formulates them." : "",
            ),
      );
  }

  // -- what is chosen

  /** An address was gone to. */
  show(path) {
    this.path = path;
    const { action, goal, call, item } = resolve(path, this.history);
    if (goal) this.rows.reveal(goal);
    this.revealing = true;
    if (item && this.isFitted) this.revealTime(item);
    this.relist();
    if (!item && !this.host.isLive) this.revealFailure();
    const hasRow = action && this.items.some(({ key }) => key === action.key);
    this.list.selected = hasRow ? action.key : goal ? goal.key : call ? "robot " + call.lane : "";
  }
  /** Let a run that is over begin with the row of its first failure in sight. */
  revealFailure() {
    const failure = failureOf(this.history),
      key = failure && (pathTo(failure).goal || "");
    this.revealed = this.items.findIndex((row) => row.key === key);
  }
  revealTime(item) {
    const { begin, end } = timesOf(item, this.history),
      { axis } = this.window,
      from = begin[axis],
      to = (end || this.now)[axis];
    if (to < this.window.from || from > this.window.to) this.window.show(from, to);
  }
  /** A row of the tree was walked to, or opened. */
  choose(row, how) {
    if (row.kind !== "goal" && row.kind !== "action") {
      this.later();
      return;
    }
    this.host.go(pathTo(row.item), how === "key");
  }
  up() {
    const { goal, action, skill } = this.path;
    if (skill) this.host.go({ goal, action });
    else if (action) this.host.go({ goal });
    else this.host.go({});
  }

  // -- what input.js calls

  isAxis(y) {
    return y < AXIS;
  }
  setCursorAt(x) {
    const { axis } = this.window,
      value = this.window.value(x),
      { from, to } = this.range(axis),
      within = Math.min(Math.max(value, from), to);
    if (axis === "time")
      this.host.setCursor({ time: Math.round(within), step: this.history.stepsUpTo(within) });
    else {
      const step = Math.round(within);
      this.host.setCursor({ time: this.history.stepTimes[step - 1] ?? this.history.begin, step });
    }
  }
  scrollBy(pixels) {
    this.list.box.scrollTop += pixels;
  }
  clickAt(x, y) {
    // the first click of two may have opened the panel: the second one means the same bar, wherever it is now
    if (performance.now() - this.clickedAt < DOUBLE_MS) return;
    this.clickedAt = performance.now();
    const found = findAt(this.scene, x, y);
    this.clicked = (found && found.item) || null;
    if (found && found.mark) this.showMark(found.mark);
    else if (found && found.item) {
      this.host.go(pathTo(found.item));
      if (!this.host.isLive) this.setCursorAt(x);
    } else if (y > AXIS) this.setCursorAt(x);
  }
  zoomAt(x) {
    if (this.clicked) this.zoomTo(this.clicked);
    else this.window.zoom(0.4, x);
  }
  zoomTo(item) {
    const { begin, end } = timesOf(item, this.history),
      { axis } = this.window;
    this.window.show(begin[axis], (end || this.now)[axis]);
  }
  zoomToSelection() {
    const { item } = resolve(this.path, this.history);
    if (item) this.zoomTo(item);
  }
  toNow() {
    this.host.setCursor(null);
    this.window.follow();
    this.later();
  }
  /** Go to the next error after the cursor, or the one before it. */
  toError(by) {
    const { marks } = this,
      at = this.host.cursor(),
      { time } = at || { time: by > 0 ? -Infinity : Infinity };
    const found =
      by > 0
        ? marks.find((mark) => mark.time > time) || marks[0]
        : marks.findLast((mark) => mark.time < time) || marks.at(-1);
    if (found) this.showMark(found);
  }
  showMark(mark) {
    this.host.setCursor({ time: mark.time, step: mark.step });
    this.window.reveal(mark[this.window.axis]);
    if (mark.call) this.host.go(pathTo(mark.call));
    this.tip.show(tipOf({ mark }, this.scene), this.window.place(mark), AXIS + MARKS);
    this.later();
  }
  hover(place) {
    const { scene } = this,
      found = place && findAt(scene, ...place),
      lines = found && tipOf(found, scene);
    this.canvas.style.cursor = place && (place[1] < AXIS ? "ew-resize" : lines ? "pointer" : "");
    if (lines) this.tip.show(lines, ...place);
    else this.tip.hide();
  }
  close() {
    this.detail.close();
    clearInterval(this.timer);
    clearTimeout(this.settling);
    cancelAnimationFrame(this.frame);
    this.resized.disconnect();
    this.scheme.removeEventListener("change", this.recolour);
    this.list.gone();
  }
}
