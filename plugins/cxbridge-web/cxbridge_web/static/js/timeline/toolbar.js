// The toolbar of the timeline: outcomes as legend and filter; search, folds, axis, zoom.
import { button, checkbox, el, plural, search } from "cx/dom.js";
import { OUTCOME_NAMES, OUTCOMES } from "cx/outcome.js";

const ZOOM = 1.7; // the factor of a press of + or −

/**
 * A button of the toolbar. If its text is only a symbol, its label for screen readers is its title up to
 * the first key in brackets, such as " (n)".
 */
const toolButton = (text, call, title, attributes = {}) =>
  button(text, call, { title, "aria-label": /\w/.test(text) ? null : title.split(" (")[0], ...attributes });
const group = (label, attributes, ...children) =>
  el.span({ role: "group", "aria-label": label, ...attributes }, ...children);
/** Set the text of a node, only if it changes: screen readers would repeat an unchanged text. */
function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export class Toolbar {
  /** @param more further elements of the toolbar */
  constructor(timeline, more = []) {
    this.timeline = timeline;
    const { timeWindow, rows } = timeline;
    this.chips = OUTCOME_NAMES.map((name) => this.chip(name));
    this.countNode = el("span.dim.count", { role: "status" });
    this.nowButton = toolButton(
      "Follow",
      () => timeline.toNow(),
      "go to the newest moment and follow it (n)",
      {
        class: "tl-now",
        hidden: !timeline.host.isLive,
      },
    );
    this.nextErrorButton = toolButton(
      "Next error",
      () => timeline.toError(1),
      "next error (e); previous error (E)",
    );
    const relist = () => timeline.relist();
    const foldButton = (text, title, isOpen) => {
      const foldAll = () => {
        rows.foldAll(isOpen);
        relist();
      };
      return toolButton(text, foldAll, title, { class: "quiet" });
    };
    const searchField = search("Search goals", (text) => {
      rows.searchText = text;
      relist();
    });
    const limitToView = (on) => {
      rows.visibleWindow = on ? timeWindow : null;
      relist();
    };
    const tools = el(
      "div.tools",
      more,
      searchField,
      checkbox("in view", false, limitToView, { title: "only goals within the visible time" }),
      group("Folds", {}, foldButton("▸", "close all", false), foldButton("▾", "open all", true)),
      checkbox("steps", false, (on) => timeWindow.useAxis(on ? "step" : "time"), {
        title: "each transition has the same width",
      }),
      this.nextErrorButton,
      group(
        "Zoom",
        { class: "tl-zoom" },
        toolButton("−", () => timeWindow.zoom(ZOOM), "zoom out (-)"),
        toolButton("+", () => timeWindow.zoom(1 / ZOOM), "zoom in (+)"),
        toolButton("Fit", () => timeWindow.fit(), "the whole run (0)"),
      ),
      this.nowButton,
    );
    const legend = el("div.tl-legend", { role: "group", "aria-label": "Outcomes" }, this.chips);
    this.box = el("div.tl-bar.panel-head", el.h2("Timeline"), this.countNode, legend, tools);
  }

  /** The button of an outcome, which filters the goals and shows their number. */
  chip(name) {
    const { rows } = this.timeline,
      { icon, word } = OUTCOMES[name],
      numberNode = el("span.tl-number");
    const press = () => {
      if (!rows.outcomes.delete(name)) rows.outcomes.add(name);
      this.timeline.relist();
    };
    const attributes = {
        class: "outcome o-" + name,
        "aria-pressed": "false",
        title: "only goals that are " + word,
      },
      chip = button([el.i({ "aria-hidden": "true" }, icon), word + " ", numberNode], press, attributes);
    return Object.assign(chip, { numberNode, outcome: name });
  }

  draw() {
    const { history, rows, timeWindow, host, list, marks } = this.timeline;
    if (host.isLive) this.drawNowButton(timeWindow.follows);
    // counting takes long, and zooming does not change the counts
    if (this.drawnItems === list.items && this.revision === history.revision) return;
    this.drawnItems = list.items;
    this.revision = history.revision;
    const counts = rows.counts();
    for (const chip of this.chips) {
      const isPressed = rows.outcomes.has(chip.outcome);
      setText(chip.numberNode, String(counts[chip.outcome]));
      chip.hidden = !counts[chip.outcome] && !isPressed;
      chip.setAttribute("aria-pressed", String(isPressed));
    }
    const shown = list.items.filter(({ kind }) => kind === "goal").length;
    setText(this.countNode, (rows.hasFilters ? shown + " of " : "") + plural(rows.goals.length, "goal"));
    this.nextErrorButton.hidden = !marks.length;
  }
  drawNowButton(isFollowing) {
    this.nowButton.setAttribute("aria-pressed", String(isFollowing));
    this.nowButton.classList.toggle("primary", !isFollowing);
    setText(this.nowButton, isFollowing ? "Following" : "Back to now");
  }
}
