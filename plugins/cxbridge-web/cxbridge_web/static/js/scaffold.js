// The common parts of views: a searched list with details beside it, and timers and listeners that end when
// the view is closed.
import { throttled } from "cx/api.js";
import { el, none, paced, panel, refill, search } from "cx/dom.js";
import { VirtualList } from "cx/virtual.js";

/** Open an address of the page, `#/...`. */
export const goTo = (address) => {
  location.hash = address;
};

/** Readers, timers and listeners of a view, until the view is closed. */
export class Lifetime {
  ends = []; // functions to call when the view is closed
  close = () => this.ends.forEach((end) => end());

  /** Call functions when the view is closed. */
  add(...ends) {
    this.ends.push(...ends);
  }
  /** Stop a limited call, see throttled() and paced(), when the view is closed. */
  stopped(call) {
    this.add(call.stop);
    return call;
  }
  /** Return a limited call, see throttled(), which stops when the view is closed. */
  reader(call, ms, failed) {
    return this.stopped(throttled(call, ms, failed));
  }
  paced(call, size) {
    return this.stopped(paced(call, size));
  }
  /** Call a function periodically while the page is visible. */
  every(ms, call) {
    const timer = setInterval(() => document.hidden || call(), ms);
    this.add(() => clearInterval(timer));
  }
  listen(target, type, call, options) {
    target.addEventListener(type, call, options);
    this.add(() => target.removeEventListener(type, call));
  }
  /** Call a function after each change of the moment of a recording. */
  follow(recording, call) {
    recording.listeners.add(call);
    this.add(() => recording.listeners.delete(call));
  }
  /** Return a function that calls `draw` in the next frame, once for several calls. */
  framed(draw) {
    let frame = 0;
    this.add(() => cancelAnimationFrame(frame));
    return () => {
      frame ||= requestAnimationFrame(() => {
        frame = 0;
        draw();
      });
    };
  }
}

/** A panel with a searched list. `split` is the element with the panel and the details beside it. */
export class ListPanel {
  wanted = ""; // the searched text in lower case
  problem = ""; // the reason why the list could not be read
  counter = el("span.dim.count");
  empty = el.div({ hidden: true });
  life = new Lifetime();

  /**
   * @param options title; find: the label of the search, or nodes that search; before, after: tools beside
   * the counter and the search; above, below: nodes above and below the list; detail: the node of the
   * details; row: options of the VirtualList
   * @param draw called after a change of the search, and after the list was read
   */
  constructor({ title, find, before, after, above = [], below = [], detail, row }, draw) {
    const onSearch = (text) => {
      this.wanted = text;
      draw();
    };
    this.draw = draw;
    this.detail = detail;
    this.list = new VirtualList({ label: title, ...row });
    this.life.add(() => this.list.gone());
    this.find = typeof find === "string" ? search(find, onSearch) : find;
    const tools = [before, this.counter, this.find, after];
    this.panel = panel(title, tools, above, this.empty, this.list.box, below);
    this.split = el("div.split", this.panel, detail);
  }

  /** Whether the search finds an item with these texts. */
  matches(...texts) {
    return !this.wanted || texts.join(" ").toLowerCase().includes(this.wanted);
  }
  /**
   * Return a limited call that reads the items, and then draws.
   * @param read reads the items; the reason of its failure is shown in place of the list. It may return false
   * if nothing has to be drawn
   */
  reader(read, ms) {
    const drawWith = (problem) => {
      this.problem = problem;
      this.draw();
    };
    const call = async () => {
      if ((await read()) !== false) drawWith("");
    };
    return this.life.reader(call, ms, (error) => drawWith(error.message));
  }
  /**
   * Show the items that the search finds.
   * @param total the number of all items
   * @param text, hint shown if there are no items at all, unless the list could not be read
   */
  show(items, total, text, hint = "") {
    const emptyTexts = this.problem ? [this.problem] : [text, hint];
    this.count(items.length, total);
    this.list.box.hidden = !items.length;
    this.empty.hidden = items.length > 0;
    if (!items.length) refill(this.empty, none(...(total ? ["Nothing matches"] : emptyTexts)));
    this.list.set(items);
  }
  count(shown, total) {
    this.counter.textContent = shown === total ? String(total) : shown + " of " + total;
  }
  /** On a narrow page, show the details in place of the list while `chosen`, a key, is not empty. */
  showDetailOf(chosen) {
    this.split.classList.toggle("has-detail", Boolean(chosen));
  }
}
