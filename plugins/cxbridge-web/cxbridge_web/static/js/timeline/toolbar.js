// The toolbar of the timeline: outcomes as legend and filter; search, folds, axis, zoom.
import { button, checkbox, el, plural, search } from "cx/dom.js";
import { NAMES, OUTCOMES } from "cx/outcome.js";

const ZOOM = 1.7; // the factor of a press

/** A button; a text that is only a symbol gets its title as the label for screen readers. */
const tool = (text, call, title, attributes = {}) =>
  button(text, call, { title, "aria-label": /\w/.test(text) ? null : title.split(" (")[0], ...attributes });
const group = (label, attributes, ...children) =>
  el.span({ role: "group", "aria-label": label, ...attributes }, ...children);
/** Change the text of a node; screen readers would repeat an unchanged text. */
function tell(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export class Toolbar {
  /** @param more further elements of the toolbar */
  constructor(timeline, more = []) {
    this.timeline = timeline;
    const { window, rows } = timeline;
    this.chips = NAMES.map((name) => this.chip(name));
    this.count = el("span.dim.count", { role: "status" });
    this.now = tool("Follow", () => timeline.toNow(), "go to the newest moment and follow it (n)", {
      class: "tl-now",
      hidden: !timeline.host.isLive,
    });
    this.error = tool("Next error", () => timeline.toError(1), "next error (e); previous error (E)");
    const relist = () => timeline.relist();
    const fold = (text, title, open) =>
      tool(text, () => relist(rows.foldAll(open)), title, { class: "quiet" });
    const find = search("Search goals", (text) => {
      rows.wanted = text;
      relist();
    });
    const show = (on) => {
      rows.inSight = on ? window : null;
      relist();
    };
    const toolBox = el(
      "div.tools",
      more,
      find,
      checkbox("in view", false, show, { title: "only goals within the visible time" }),
      group("Folds", {}, fold("▸", "close all", false), fold("▾", "open all", true)),
      checkbox("steps", false, (on) => window.use(on ? "step" : "time"), {
        title: "each transition has the same width",
      }),
      this.error,
      group(
        "Zoom",
        { class: "tl-zoom" },
        tool("−", () => window.zoom(ZOOM), "zoom out (-)"),
        tool("+", () => window.zoom(1 / ZOOM), "zoom in (+)"),
        tool("Fit", () => window.fit(), "the whole run (0)"),
      ),
      this.now,
    );
    const legend = el("div.tl-legend", { role: "group", "aria-label": "Outcomes" }, this.chips);
    this.box = el("div.tl-bar.panel-head", el.h2("Timeline"), this.count, legend, toolBox);
  }

  /** The button of an outcome, which filters the goals and shows their number. */
  chip(name) {
    const { rows } = this.timeline,
      { icon, word } = OUTCOMES[name],
      number = el("span.tl-number");
    const press = () => {
      if (!rows.outcomes.delete(name)) rows.outcomes.add(name);
      this.timeline.relist();
    };
    const about = {
        class: "outcome o-" + name,
        "aria-pressed": "false",
        title: "only goals that are " + word,
      },
      chip = button([el.i({ "aria-hidden": "true" }, icon), word + " ", number], press, about);
    return Object.assign(chip, { number, outcome: name });
  }

  draw() {
    const { history, rows, window, host, list, marks } = this.timeline;
    if (host.isLive) this.drawNow(window.follows);
    // counting takes long, and zooming does not change the counts
    if (this.drawnItems === list.items && this.revision === history.revision) return;
    this.drawnItems = list.items;
    this.revision = history.revision;
    const counts = rows.counts();
    for (const chip of this.chips) {
      const isPressed = rows.outcomes.has(chip.outcome);
      tell(chip.number, String(counts[chip.outcome]));
      chip.hidden = !counts[chip.outcome] && !isPressed;
      chip.setAttribute("aria-pressed", String(isPressed));
    }
    const shown = list.items.filter(({ kind }) => kind === "goal").length;
    tell(this.count, (rows.hasFilters ? shown + " of " : "") + plural(rows.goals.length, "goal"));
    this.error.hidden = !marks.length;
  }
  drawNow(follows) {
    this.now.setAttribute("aria-pressed", String(follows));
    this.now.classList.toggle("primary", !follows);
    tell(this.now, follows ? "Following" : "Back to now");
  }
}
