// The timeline: goals, plan-actions, skill calls and errors over time.
import { Canvas, fillBox } from "cx/canvas.js";
import { Detail } from "cx/detail.js";
import { el, none, refill } from "cx/dom.js";
import { failureOf, lateCalls } from "cx/story/causes.js";
import { findAt, Tip, tipOf } from "cx/timeline/find.js";
import { keyInput, pointerInput } from "cx/timeline/input.js";
import { nameOf, Rows, signOf } from "cx/timeline/rows.js";
import { marksOf } from "cx/timeline/marks.js";
import { Overview } from "cx/timeline/overview.js";
import { AXIS, MARKS, Painter } from "cx/timeline/paint.js";
import { pathTo, resolve } from "cx/timeline/host.js";
import { timesOf } from "cx/timeline/spans.js";
import { Toolbar } from "cx/timeline/toolbar.js";
import { TimeWindow } from "cx/timeline/window.js";
import { VirtualList } from "cx/virtual.js";

const LIVE_MS = 50, // the period of drawing a live run
  SETTLED_MS = 160, // the filter "in view" is applied again when the window has not moved for this time
  DOUBLE_MS = 300, // the longest time between the clicks of a double click
  LATE_MS = 500; // the period of searching for late calls

export class Timeline {
  /** @param host see host.js @param tools further elements of the toolbar */
  constructor(host, tools = []) {
    this.host = host;
    this.path = {};
    this.clickedAt = -Infinity;
    this.clickedItem = null; // the item of the last click
    this.shape = -1; // the shape of the history whose rows are listed
    this.rows = Rows.of(host.history);
    this.timeWindow = new TimeWindow((axis) => this.range(axis));
    this.timeWindow.follows = host.isLive;
    this.build(tools);
    this.timeWindow.listeners.add(() => this.moved());
    pointerInput(this.canvas.node, this);
    keyInput(this.box, this);
    if (host.isLive) this.tickTimer = setInterval(() => this.tick(), LIVE_MS);
    this.relist();
  }

  build(tools) {
    this.canvas = new Canvas((...args) => this.draw(...args), { class: "tl-chart" });
    this.overview = new Overview(this);
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
      resized: () => this.later(),
    });
    this.list.box.classList.add("tl-names");
    this.list.box.addEventListener("scroll", () => this.later(), { passive: true });
    this.detail = new Detail(this.host, () => this.later());
    this.toolbar = new Toolbar(this, tools);
    this.tip = new Tip(this.canvas.node);
    this.emptyBox = el("div.tl-empty", { hidden: true });
    const corner = el("div.tl-corner.dim", el.span("errors")),
      body = el("div.tl-body", corner, this.canvas.node, this.list.box, this.emptyBox, this.tip.box),
      main = el("div.tl-main", this.overview.canvas.node, body);
    this.box = el("div.tl", this.toolbar.box, el("div.tl-columns", main, this.detail.box));
    this.box.timeline = this; // for scripts that drive the page
  }

  // -- scene

  get history() {
    return this.host.history;
  }
  get now() {
    return this.host.now();
  }
  get zero() {
    return this.host.zero;
  }
  /** The range of the run on an axis: {from, to}. */
  range(axis) {
    const { history } = this,
      begin = history.begin ?? this.now.time,
      // the picture of a finished run stops shrinking
      isOver = this.host.isLive && history.steps > 0 && !history.hasOpenItems,
      end = isOver ? history.stepTimes.at(-1) : this.now.time;
    if (axis === "step") return { from: 0, to: Math.max(1, history.steps) };
    return { from: begin, to: Math.max(end, begin + 1000) };
  }
  /** The chosen moment as a value of the axis; null: now. */
  get cursorValue() {
    return this.host.cursor()?.[this.timeWindow.axis] ?? null;
  }
  /** The pixel of the chosen moment; the middle without a visible moment. */
  get cursorX() {
    const value = this.cursorValue,
      x = value === null ? -1 : this.timeWindow.x(value);
    return x >= 0 && x <= this.timeWindow.width ? x : this.timeWindow.width / 2;
  }
  /** The step of the chosen moment; Infinity: now. */
  get cursorStep() {
    return this.host.cursor()?.step ?? Infinity;
  }
  get marks() {
    return marksOf(this.history);
  }
  /** The late skill calls, a Set; searched once in LATE_MS at most. */
  get late() {
    const nowMs = performance.now();
    if (!this.searchedLateAt || nowMs - this.searchedLateAt > LATE_MS) {
      this.searchedLateAt = nowMs;
      this.lateCalls = new Set(lateCalls(this.history, this.now.time).keys());
    }
    return this.lateCalls;
  }
  /**
   * What is drawn: timeWindow, history, rows, marks; now and zero, see host.js; late: the late calls;
   * rowHeight and scroll: pixels; selected: the key of the selected row; chosen: the item of the path.
   */
  get scene() {
    const { timeWindow, history, now, zero, late, marks, list } = this;
    return {
      ...{ timeWindow, history, now, zero, late, marks, rowHeight: list.rowHeight, selected: list.selected },
      ...{ rows: list.items, scroll: list.box.scrollTop, chosen: resolve(this.path, history).item },
    };
  }

  // -- drawing

  /** Draw in the next frame, once for several calls. */
  later() {
    this.canvas.later();
  }
  /** Draw again after a change of the history. */
  update() {
    if (this.history.shape !== this.shape || this.rows.hasFilters) this.relist();
    else this.later();
    this.timeWindow.advance();
  }
  /** Make the rows again. */
  relist() {
    this.shape = this.history.shape;
    this.items = this.rows.list();
    this.isListDirty = true;
    this.later();
  }
  /** Draw again after a change of the window. */
  moved() {
    this.later();
    if (!this.rows.visibleWindow) return;
    clearTimeout(this.settleTimer);
    this.settleTimer = setTimeout(() => this.relist(), SETTLED_MS);
  }
  /** Move the window to the present moment of a live run, and draw again. */
  tick() {
    const { time } = this.now;
    if (document.hidden || !this.box.isConnected || time === this.tickedAt) return;
    this.tickedAt = time;
    this.timeWindow.advance();
    this.later();
  }

  draw(context, width, height, palette) {
    const { timeWindow, list, isListDirty } = this,
      namesSign = this.history.revision + " " + this.cursorStep,
      isResized = timeWindow.width !== width;
    timeWindow.width = width;
    if (!this.isFitted || (isResized && timeWindow.fits)) timeWindow.fit();
    this.isFitted = true;
    if (isListDirty) this.drawList();
    else if (this.namesSign !== namesSign) list.update();
    this.namesSign = namesSign;
    this.paint(context, width, height, palette);
    if (isListDirty) {
      this.later(); // in a further frame: thousands of rows would take too long
      return;
    }
    this.overview.draw();
    this.toolbar.draw();
    this.detail.draw(this.path);
    this.drawEmpty();
  }
  drawList() {
    const { list } = this;
    this.isListDirty = false;
    list.set(this.items);
    if (this.mustReveal) list.mark(list.selected, true);
    if (this.failureRowAt > 0) list.reveal(this.failureRowAt);
    this.mustReveal = false;
    this.failureRowAt = 0; // none: the first row is visible anyway
  }
  paint(context, width, height, palette) {
    const { scene, cursorValue } = this,
      { rowHeight, scroll, rows } = scene,
      top = AXIS + MARKS;
    fillBox(context, palette.back, 0, 0, width, height);
    const painter = new Painter(context, { ...scene, palette });
    painter.axis(height);
    painter.errors(scene.marks);
    context.save();
    context.beginPath();
    context.rect(0, top, width, height);
    context.clip();
    const first = Math.max(0, Math.floor(scroll / rowHeight)),
      end = Math.min(rows.length, Math.ceil((scroll + height) / rowHeight));
    for (let at = first; at < end; at++) painter.row(rows[at], top + at * rowHeight - scroll);
    context.restore();
    if (cursorValue !== null) painter.cursor(cursorValue, height);
  }
  drawEmpty() {
    const isEmpty = !this.list.items.length,
      hint = this.host.isLive ? "They appear here as soon as the executive formulates them." : "",
      texts = this.rows.hasFilters
        ? ["No goal matches", "Choose other outcomes, or change the search."]
        : ["No goals yet", hint];
    this.emptyBox.hidden = !isEmpty;
    if (isEmpty) refill(this.emptyBox, none(...texts));
  }

  // -- selection

  /** Show the path of an address. */
  show(path) {
    this.path = path;
    const { action, goal, call, item } = resolve(path, this.history);
    if (goal) this.rows.reveal(goal);
    this.mustReveal = true;
    if (item && this.isFitted) this.revealTime(item);
    this.relist();
    if (!item && !this.host.isLive) this.revealFailure();
    const hasRow = action && this.items.some(({ key }) => key === action.key);
    this.list.selected = hasRow ? action.key : goal ? goal.key : call ? "robot " + call.lane : "";
  }
  /** Scroll to the goal of a recording's failure, see failureOf(), when the rows are drawn. */
  revealFailure() {
    const failure = failureOf(this.history),
      key = failure && (pathTo(failure).goal || "");
    this.failureRowAt = this.items.findIndex((row) => row.key === key);
  }
  /** The begin and end of an item, as values of the axis. */
  rangeOf(item) {
    const { begin, end } = timesOf(item, this.history);
    return [begin, end || this.now].map((point) => point[this.timeWindow.axis]);
  }
  revealTime(item) {
    const [from, to] = this.rangeOf(item);
    if (to < this.timeWindow.from || from > this.timeWindow.to) this.timeWindow.show(from, to);
  }
  /** Choose a row of the tree. @param how "key": the user walked to the row with the arrow keys */
  choose({ kind, item }, how) {
    if (kind === "goal" || kind === "action") this.host.go(pathTo(item), how === "key");
    else this.later();
  }
  /** Go up one level: from a call to its action, from an action to its goal, from a goal to the story. */
  up() {
    const { goal, action, skill } = this.path;
    this.host.go(skill ? { goal, action } : action ? { goal } : {});
  }

  // -- input

  isAxis(y) {
    return y < AXIS;
  }
  /** Choose the moment at a pixel. */
  setCursorAt(x) {
    const { axis } = this.timeWindow,
      { from, to } = this.range(axis),
      value = Math.round(Math.min(Math.max(this.timeWindow.value(x), from), to)),
      { history } = this;
    this.host.setCursor(
      axis === "time"
        ? { time: value, step: history.stepsUpTo(value) }
        : { time: history.stepTimes[value - 1] ?? history.begin, step: value },
    );
  }
  scrollBy(pixels) {
    this.list.box.scrollTop += pixels;
  }
  clickAt(x, y) {
    // the first click of a double click may move the bars: the second click is for the same bar
    if (performance.now() - this.clickedAt < DOUBLE_MS) return;
    this.clickedAt = performance.now();
    const { mark, item = null } = findAt(this.scene, x, y) || {};
    this.clickedItem = item;
    if (mark) this.showMark(mark);
    if (item) this.host.go(pathTo(item));
    // in a live run, a press on an item does not leave the present moment
    if (!mark && y > AXIS && (!item || !this.host.isLive)) this.setCursorAt(x);
  }
  /** Show the item of a double click, or zoom in where there is none. */
  zoomAt(x) {
    if (this.clickedItem) this.zoomTo(this.clickedItem);
    else this.timeWindow.zoom(0.4, x);
  }
  zoomTo(item) {
    this.timeWindow.show(...this.rangeOf(item));
  }
  zoomToSelection() {
    const { item } = resolve(this.path, this.history);
    if (item) this.zoomTo(item);
  }
  toNow() {
    this.host.setCursor(null);
    this.timeWindow.follow();
    this.later();
  }
  /**
   * Go to the next error after the chosen moment, or to the last error before it. The last error and the
   * first are neighbours.
   * @param by 1 or -1
   */
  toError(by) {
    const { marks } = this,
      { time } = this.host.cursor() || { time: by > 0 ? -Infinity : Infinity },
      next = () => marks.find((each) => each.time > time) || marks[0],
      previous = () => marks.findLast((each) => each.time < time) || marks.at(-1),
      mark = by > 0 ? next() : previous();
    if (mark) this.showMark(mark);
  }
  showMark(mark) {
    const { time, step } = mark;
    this.host.setCursor({ time, step });
    this.timeWindow.reveal(mark[this.timeWindow.axis]);
    if (mark.call) this.host.go(pathTo(mark.call));
    this.tip.show(tipOf({ mark }, this.scene), this.timeWindow.place(mark), AXIS + MARKS);
    this.later();
  }
  /** @param place [x, y] of the pointer; null: the pointer has left */
  hover(place) {
    const hit = place && findAt(this.scene, ...place),
      lines = hit && tipOf(hit, this.scene);
    this.canvas.node.style.cursor = place && (this.isAxis(place[1]) ? "ew-resize" : lines ? "pointer" : "");
    if (lines) this.tip.show(lines, ...place);
    else this.tip.hide();
  }
  close() {
    this.detail.close();
    clearInterval(this.tickTimer);
    clearTimeout(this.settleTimer);
    for (const part of [this.canvas, this.overview, this.list]) part.gone();
  }
}
