// Lists and trees of any length: only visible rows are elements. The arrow keys walk through a list; in a
// tree, left and right close and open a row.
import { el, refill } from "cx/dom.js";

const EXTRA_ROWS = 6; // above and below the visible rows
const DEFAULT_HEIGHT = 30; // pixels
const RELEASES = ["pointerup", "pointercancel", "blur"];
let listCount = 0; // makes the ids of rows unique

/** A list or tree whose visible rows are elements. */
export class VirtualList {
  /**
   * @param label the name of the list for screen readers
   * @param key(item) a text that identifies a row
   * @param sign(item) a text that changes when the row has to be drawn again
   * @param draw(item) the content of the row: nodes
   * @param select(item, how) called when a row is chosen: by "click", "key" or "enter"
   * @param open(item, isOpen) called when the user opens or closes a row; only for trees
   * @param resized() called when the rows may have another height, which a picture beside the list follows
   * @param height the CSS variable with the height of a row
   */
  constructor({ label, key, sign, draw, select = null, open = null, resized = null, height = "--row" }) {
    Object.assign(this, { key, sign, draw, select, open, height, items: [], selected: null, knownHeight: 0 });
    this.name = "list" + ++listCount;
    this.rows = new Map(); // key -> {sign, node} of a visible row
    this.room = el("div.room", { role: "presentation" });
    const role = open ? "tree" : "listbox";
    this.box = el("div.scroll", { role, tabindex: 0, "aria-label": label }, this.room);
    this.box.addEventListener("scroll", () => this.later(), { passive: true });
    this.box.addEventListener("keydown", (event) => this.onKey(event));
    // A row that is drawn again between press and release would get no click: the list holds still meanwhile.
    this.isHeld = false;
    this.box.addEventListener("pointerdown", (event) => {
      this.isHeld = event.target.closest(".row") !== null;
    });
    this.release = () => {
      if (this.isHeld) this.later();
      this.isHeld = false;
    };
    for (const end of RELEASES) window.addEventListener(end, this.release);
    this.box.addEventListener("click", (event) => this.onClick(event));
    this.sizeObserver = new ResizeObserver(() => {
      this.knownHeight = 0; // on a narrow page rows are higher
      this.later();
      resized?.();
    });
    this.sizeObserver.observe(this.box);
  }

  later() {
    this.frame ||= requestAnimationFrame(() => {
      this.frame = 0;
      this.update();
    });
  }

  /**
   * Show items. Items of a tree have `depth`, and `open`: true or false, or null for an item without
   * children.
   */
  set(items) {
    this.items = items;
    this.update();
  }

  /** Select the row of a key. @param reveal whether to scroll to the row */
  mark(key, reveal = false) {
    this.selected = key;
    if (reveal) this.reveal(this.items.findIndex((item) => this.key(item) === key));
    this.update();
  }

  /** The height of a row in pixels; a list without a style yet is measured again. */
  get rowHeight() {
    this.knownHeight ||= parseFloat(getComputedStyle(this.box).getPropertyValue(this.height)) || 0;
    return this.knownHeight || DEFAULT_HEIGHT;
  }

  /** Draw the visible rows; rows with the same sign keep their elements. */
  update() {
    if (this.isHeld) return; // see the constructor
    const { box, room, rowHeight, items, rows: oldRows } = this;
    room.style.height = items.length * rowHeight + "px";
    const first = Math.max(0, Math.floor(box.scrollTop / rowHeight) - EXTRA_ROWS);
    const end = Math.min(
      items.length,
      Math.ceil((box.scrollTop + box.clientHeight) / rowHeight) + EXTRA_ROWS,
    );
    this.rows = new Map();
    for (let at = first; at < end; at++) {
      const item = items[at],
        key = this.key(item),
        isChosen = key === this.selected,
        sign = [at, isChosen, rowHeight, items.length, this.sign(item)].join(" ");
      let row = oldRows.get(key);
      if (!row || row.sign !== sign) row = { sign, node: this.row(item, at, isChosen) };
      this.rows.set(key, row);
      if (isChosen) box.setAttribute("aria-activedescendant", row.node.id);
    }
    const nodes = [...this.rows.values()].map(({ node }) => node);
    if (nodes.length !== room.children.length || nodes.some((node, at) => room.children[at] !== node))
      room.replaceChildren(...nodes);
  }

  /** Make the element of a row. */
  row(item, at, isChosen) {
    const { rowHeight } = this,
      isTree = this.open !== null,
      icon = item.open === null ? "" : item.open ? "▾" : "▸";
    const node = el.div({
      class: ["row", isChosen && "selected"].filter(Boolean).join(" "),
      id: this.name + "-" + at,
      role: isTree ? "treeitem" : "option",
      "aria-posinset": at + 1,
      "aria-setsize": this.items.length,
      "aria-selected": String(isChosen),
      "aria-level": isTree ? item.depth + 1 : null,
      "aria-expanded": isTree && item.open !== null ? String(item.open) : null,
      style: `top: ${at * rowHeight}px; height: ${rowHeight}px`,
    });
    // deeper rows have the indent of level 12
    const style = `margin-left: calc(${Math.min(item.depth, 12)} * var(--indent))`;
    refill(node, isTree && el("span.fold", { "aria-hidden": "true", style }, icon), this.draw(item));
    return node;
  }

  /** Scroll to the row with an index. */
  reveal(at) {
    if (at < 0) return;
    const { box, rowHeight } = this,
      top = at * rowHeight;
    if (top < box.scrollTop) box.scrollTop = top;
    else if (top + rowHeight > box.scrollTop + box.clientHeight)
      box.scrollTop = top + rowHeight - box.clientHeight;
  }

  toEnd() {
    this.box.scrollTop = this.items.length * this.knownHeight;
    this.update();
  }
  /** Whether the end of the list is visible, give or take two rows. */
  get atEnd() {
    return this.box.scrollTop + this.box.clientHeight >= (this.items.length - 2) * this.knownHeight;
  }

  choose(at, how) {
    const item = this.items[at];
    if (!item) return;
    this.selected = this.key(item);
    this.reveal(at);
    this.update();
    if (this.select) this.select(item, how);
  }

  fold(item, isOpen) {
    if (this.open && item.open !== null && item.open !== isOpen) this.open(item, isOpen);
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
    const { items } = this;
    if (event.ctrlKey || event.metaKey || event.altKey || event.target !== this.box || !items.length) return;
    const at = items.findIndex((item) => this.key(item) === this.selected),
      item = items[at],
      page = Math.max(1, Math.floor(this.box.clientHeight / this.knownHeight) - 1), // rows
      moves = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity };
    if (event.key in moves) {
      const next = at < 0 && event.key !== "End" ? 0 : at + moves[event.key];
      this.choose(Math.max(0, Math.min(items.length - 1, next)), "key");
    } else if (event.key === "Enter" && item) this.choose(at, "enter");
    else if (this.open && item && event.key === "ArrowRight") {
      if (item.open === false) this.fold(item, true);
      else this.choose(at + 1, "key");
    } else if (this.open && item && event.key === "ArrowLeft") {
      if (item.open) this.fold(item, false);
      else this.choose(this.above(at), "key");
    } else return;
    event.preventDefault();
  }

  /** The index of the parent's row; -1 for a root. */
  above(at) {
    return this.items.slice(0, at).findLastIndex((each) => each.depth < this.items[at].depth);
  }

  /** End all listening; called when the list leaves the page. */
  gone() {
    this.sizeObserver.disconnect();
    for (const end of RELEASES) window.removeEventListener(end, this.release);
    cancelAnimationFrame(this.frame);
  }
}
