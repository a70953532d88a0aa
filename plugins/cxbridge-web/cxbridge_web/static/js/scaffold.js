// The scaffold of views: a list with a search, details beside the list, and all that ends with the view.
import { throttled } from "cx/api.js";
import { el, none, paced, panel, refill, search } from "cx/dom.js";
import { VirtualList } from "cx/virtual.js";

/** Readers, timers and listeners of a view, until the view is closed. */
export class Lifetime {
  ends = [];
  close = () => this.ends.forEach((end) => end());

  add(...ends) {
    this.ends.push(...ends);
  }
  reader(call, ms, failed) {
    return this.stopped(throttled(call, ms, failed));
  }
  paced(call, size) {
    return this.stopped(paced(call, size));
  }
  stopped(call) {
    this.add(call.stop);
    return call;
  }
  /** Call again and again while the page is seen. */
  every(ms, call) {
    const timer = setInterval(() => document.hidden || call(), ms);
    this.add(() => clearInterval(timer));
  }
  listen(target, type, call, options) {
    target.addEventListener(type, call, options);
    this.add(() => target.removeEventListener(type, call));
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

/** A panel with a searched list; `split` has the panel and, if there are any, the details beside it. */
export class ListPanel {
  /**
   * @param life of the view
   * @param options title; find: label of the search, or nodes that search; before, after: tools beside counter and search; above: nodes
   * between the tools and the list; below; detail: a node; row: options of the list
   * @param draw called when another text is searched
   */
  constructor(life, { title, find, before, after, above = [], below = [], detail, row }, draw) {
    this.wanted = "";
    this.list = new VirtualList({ label: title, ...row });
    life.add(() => this.list.gone());
    this.counter = el("span.dim.count");
    this.empty = el.div({ hidden: true });
    const searched = (text) => {
      this.wanted = text;
      draw();
    };
    this.find = typeof find === "string" ? search(find, searched) : find;
    this.panel = panel(
      title,
      [before, this.counter, this.find, after],
      above,
      this.empty,
      this.list.box,
      below,
    );
    this.detail = detail;
    this.split = el("div.split", this.panel, detail);
  }

  matches(...words) {
    return !this.wanted || words.join(" ").toLowerCase().includes(this.wanted);
  }
  /** @param nothing text and hint in place of an empty list, or a node */
  show(items, total, nothing) {
    this.count(items.length, total);
    this.list.box.hidden = !items.length;
    this.empty.hidden = items.length > 0;
    if (!items.length) refill(this.empty, nothing instanceof Node ? nothing : none(...[nothing].flat()));
    this.list.set(items);
  }
  count(shown, total) {
    this.counter.textContent = shown === total ? String(total) : shown + " of " + total;
  }
  /** On a phone details are in the place of the list. */
  showsDetail(on) {
    this.split.classList.toggle("has-detail", Boolean(on));
  }
}
