// The parts of views: a searched list with details beside it, and timers and listeners that end with the view.
import { throttled } from "cx/api.js";
import { el, none, paced, panel, refill, search } from "cx/dom.js";
import { VirtualList } from "cx/virtual.js";

export const goTo = (address) => {
  location.hash = address;
};

/** Readers, timers and listeners of a view, until the view is closed. */
export class Lifetime {
  ends = [];
  close = () => this.ends.forEach((end) => end());

  add(...ends) {
    this.ends.push(...ends);
  }
  stopped(call) {
    this.add(call.stop);
    return call;
  }
  reader(call, ms, failed) {
    return this.stopped(throttled(call, ms, failed));
  }
  paced(call, size) {
    return this.stopped(paced(call, size));
  }
  every(ms, call) {
    const timer = setInterval(() => document.hidden || call(), ms);
    this.add(() => clearInterval(timer));
  }
  listen(target, type, call, options) {
    target.addEventListener(type, call, options);
    this.add(() => target.removeEventListener(type, call));
  }
  follow(recording, call) {
    recording.listeners.add(call);
    this.add(() => recording.listeners.delete(call));
  }
  /** Returns a call that draws once in the next frame. */
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

/** A panel with a searched list. `split` has the panel and its details. */
export class ListPanel {
  wanted = "";
  problem = ""; // the reason why the list could not be read
  counter = el("span.dim.count");
  empty = el.div({ hidden: true });
  life = new Lifetime();

  /**
   * @param options title; find: label of the search, or nodes that search; before, after: tools beside
   * counter and search; above, below: nodes beside the list; detail: a node; row: options of the list
   * @param draw called after a change of the search, and after the list was read
   */
  constructor({ title, find, before, after, above = [], below = [], detail, row }, draw) {
    const searched = (text) => {
      this.wanted = text;
      draw();
    };
    this.draw = draw;
    this.detail = detail;
    this.list = new VirtualList({ label: title, ...row });
    this.life.add(() => this.list.gone());
    this.find = typeof find === "string" ? search(find, searched) : find;
    const tools = [before, this.counter, this.find, after];
    this.panel = panel(title, tools, above, this.empty, this.list.box, below);
    this.split = el("div.split", this.panel, detail);
  }

  matches(...words) {
    return !this.wanted || words.join(" ").toLowerCase().includes(this.wanted);
  }
  /** @param read reads the items; the reason of its failure is shown in place of the list */
  reader(read, ms) {
    const drawn = (problem) => {
      this.problem = problem;
      this.draw();
    };
    const call = async () => {
      if ((await read()) !== false) drawn("");
    };
    return this.life.reader(call, ms, (error) => drawn(error.message));
  }
  /** @param text, hint shown in place of an empty list */
  show(items, total, text, hint = "") {
    const nothing = this.problem ? [this.problem] : [text, hint];
    this.count(items.length, total);
    this.list.box.hidden = !items.length;
    this.empty.hidden = items.length > 0;
    if (!items.length) refill(this.empty, none(...(total ? ["Nothing matches"] : nothing)));
    this.list.set(items);
  }
  count(shown, total) {
    this.counter.textContent = shown === total ? String(total) : shown + " of " + total;
  }
  /** Show the details in place of the list on a phone. */
  showsDetail(on) {
    this.split.classList.toggle("has-detail", Boolean(on));
  }
}
