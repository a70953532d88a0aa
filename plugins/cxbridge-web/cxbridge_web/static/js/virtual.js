// Lists of any length: only the rows that are seen exist. Arrows walk; in a tree left and right close and
// open.
import { el } from "cx/dom.js";

const EXTRA = 6;
const RELEASES = ["pointerup", "pointercancel", "blur"];
let lists = 0;

export class VirtualList {
  /**
   * @param label what list it is, for screen readers
   * @param key(item) unique text of a row
   * @param sign(item) text that changes when the row has to be drawn again
   * @param draw(item) the content of the row: nodes
   * @param select(item) a row was chosen; open(item, wanted) a fold was used (trees only)
   */
  constructor({ label, key, sign, draw, select = null, open = null, height = "--row" }) {
    Object.assign(this, { key, sign, draw, select, open, height });
    this.items = [];
    this.selected = null;
    this.name = "list" + ++lists;
    this.rows = new Map();
    this.room = el("div", { class: "room", role: "presentation" });
    this.box = el(
      "div",
      { class: "scroll", role: open ? "tree" : "listbox", tabindex: 0, "aria-label": label },
      this.room,
    );
    this.box.addEventListener("scroll", () => this.later(), { passive: true });
    this.box.addEventListener("keydown", (event) => this.onKey(event));
    // A row that is drawn again between press and release would get no click: the list holds still meanwhile.
    this.held = false;
    this.box.addEventListener("pointerdown", (event) => {
      this.held = event.target.closest(".row") !== null;
    });
    this.release = () => {
      if (this.held) {
        this.held = false;
        this.later();
      }
    };
    for (const end of RELEASES) window.addEventListener(end, this.release);
    this.box.addEventListener("click", (event) => this.onClick(event));
    this.resized = new ResizeObserver(() => {
      this.high = 0; // on a narrow page rows are higher
      this.later();
    });
    this.resized.observe(this.box);
    this.high = 0;
  }

  later() {
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      this.update();
    });
  }

  /** Show these; items of a tree have depth, and open: true, false, or null for leaves. */
  set(items) {
    this.items = items;
    this.update();
  }

  mark(key, reveal = false) {
    this.selected = key;
    if (reveal) this.reveal(this.items.findIndex((item) => this.key(item) === key));
    this.update();
  }

  /** The height of a row in pixels. A list that is no part of the page yet has no style: that is no answer. */
  get rowHeight() {
    if (!this.high || !this.isMeasured) {
      this.isMeasured = this.box.isConnected;
      this.high = parseFloat(getComputedStyle(this.box).getPropertyValue(this.height)) || 30;
    }
    return this.high;
  }

  update() {
    if (this.held) return;
    const { box, room, rowHeight: high, items } = this;
    room.style.height = items.length * high + "px";
    const first = Math.max(0, Math.floor(box.scrollTop / high) - EXTRA);
    const end = Math.min(items.length, Math.ceil((box.scrollTop + box.clientHeight) / high) + EXTRA);
    const old = this.rows;
    this.rows = new Map();
    const nodes = [];
    for (let at = first; at < end; at++) {
      const item = items[at],
        key = this.key(item),
        chosen = key === this.selected;
      const sign = at + " " + chosen + " " + high + " " + items.length + " " + this.sign(item);
      let row = old.get(key);
      if (!row || row.sign !== sign) row = { sign, node: this.row(item, at, chosen) };
      this.rows.set(key, row);
      nodes.push(row.node);
      if (chosen) box.setAttribute("aria-activedescendant", row.node.id);
    }
    if (nodes.length !== room.children.length || nodes.some((node, at) => room.children[at] !== node))
      room.replaceChildren(...nodes);
  }

  row(item, at, chosen) {
    const tree = this.open !== null;
    const node = el("div", {
      class: "row" + (chosen ? " selected" : "") + (item.rowClass ? " " + item.rowClass : ""),
      id: this.name + "-" + at,
      role: tree ? "treeitem" : "option",
      "aria-posinset": at + 1,
      "aria-setsize": this.items.length,
      "aria-selected": String(chosen),
      "aria-level": tree ? item.depth + 1 : null,
      "aria-expanded": tree && item.open !== null ? String(item.open) : null,
    });
    if (tree) {
      const fold = el(
        "span",
        { class: "fold", "aria-hidden": "true" },
        item.open === null ? "" : item.open ? "▾" : "▸",
      );
      fold.style.marginLeft = `calc(${Math.min(item.depth, 12)} * var(--indent))`;
      node.append(fold);
    }
    node.append(...[this.draw(item)].flat().filter((child) => child !== null));
    node.style.top = at * this.high + "px";
    node.style.height = this.high + "px";
    return node;
  }

  reveal(at) {
    if (at < 0) return;
    const high = this.rowHeight;
    const top = at * high,
      { box } = this;
    if (top < box.scrollTop) box.scrollTop = top;
    else if (top + high > box.scrollTop + box.clientHeight) box.scrollTop = top + high - box.clientHeight;
  }

  toEnd() {
    this.box.scrollTop = this.items.length * this.high;
    this.update();
  }
  get atEnd() {
    return this.box.scrollTop + this.box.clientHeight >= this.items.length * this.high - 2 * this.high;
  }

  choose(at, how) {
    if (at < 0 || at >= this.items.length) return;
    const item = this.items[at];
    this.selected = this.key(item);
    this.reveal(at);
    this.update();
    if (this.select) this.select(item, how);
  }

  fold(item, wanted) {
    if (this.open && item.open !== null && item.open !== wanted) this.open(item, wanted);
  }

  onClick(event) {
    const row = event.target.closest(".row");
    if (!row || event.target.closest("a, button")) return;
    const at = Number(row.getAttribute("aria-posinset")) - 1,
      item = this.items[at];
    if (event.target.closest(".fold") && item.open !== null && this.open) this.fold(item, !item.open);
    else this.choose(at, "click");
  }

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target !== this.box || !this.items.length)
      return;
    const at = this.items.findIndex((item) => this.key(item) === this.selected),
      item = this.items[at];
    const page = Math.max(1, Math.floor(this.box.clientHeight / this.high) - 1);
    const moves = {
      ArrowDown: 1,
      ArrowUp: -1,
      PageDown: page,
      PageUp: -page,
      Home: -this.items.length,
      End: this.items.length,
    };
    if (event.key in moves)
      this.choose(
        at < 0
          ? event.key === "End"
            ? this.items.length - 1
            : 0
          : Math.max(0, Math.min(this.items.length - 1, at + moves[event.key])),
        "key",
      );
    else if (event.key === "Enter" && item) this.choose(at, "enter");
    else if (this.open && item && event.key === "ArrowRight") {
      if (item.open === false) this.fold(item, true);
      else this.choose(at + 1, "key");
    } else if (this.open && item && event.key === "ArrowLeft") {
      if (item.open) this.fold(item, false);
      else
        this.choose(
          this.items.slice(0, at).findLastIndex((each) => each.depth < item.depth),
          "key",
        );
    } else return;
    event.preventDefault();
  }

  gone() {
    this.resized.disconnect();
    for (const end of RELEASES) window.removeEventListener(end, this.release);
    if (this.frame) cancelAnimationFrame(this.frame);
  }
}
