// Above the timeline: outcomes, which are the legend and a filter; search, folds, axis, zoom.
import { button, checkbox, el, search } from "cx/dom.js";
import { NAMES, OUTCOMES } from "cx/outcome.js";

export class Toolbar {
  /** @param more elements of the page that shows the timeline */
  constructor(timeline, more = []) {
    this.timeline = timeline;
    const { window, rows } = timeline;
    this.chips = NAMES.map((name) => this.chip(name));
    this.count = el("span.dim.count", { role: "status" });
    this.now = button("Follow", () => timeline.toNow(), {
      class: "tl-now",
      title: "go to the newest moment, and follow it (n)",
    });
    this.now.hidden = !timeline.host.isLive;
    this.error = button("Next error", () => timeline.toError(1), { title: "e; the one before: E" });
    this.byStep = checkbox("steps", false, (on) => window.use(on ? "step" : "time"));
    this.byStep.title = "each transition is as wide as any other";
    const folds = el.span(
      { role: "group", "aria-label": "Folds" },
      button("▸", () => this.fold(false), { class: "quiet", "aria-label": "close all", title: "close all" }),
      button("▾", () => this.fold(true), { class: "quiet", "aria-label": "open all", title: "open all" }),
    );
    const zoom = el(
      "span.tl-zoom",
      { role: "group", "aria-label": "Zoom" },
      button("−", () => window.zoom(1.7), { "aria-label": "zoom out", title: "zoom out (-)" }),
      button("+", () => window.zoom(1 / 1.7), { "aria-label": "zoom in", title: "zoom in (+)" }),
      button("Fit", () => window.fit(), { title: "the whole run (0)" }),
    );
    const find = search("Search goals", (text) => {
      rows.wanted = text;
      timeline.relist();
    });
    const sight = checkbox("in view", false, (on) => {
      rows.inSight = on ? window : null;
      timeline.relist();
    });
    sight.title = "only goals that are there in the time that is seen";
    this.box = el(
      "div.tl-bar.panel-head",
      el.h2("Timeline"),
      this.count,
      el("div.tl-legend", { role: "group", "aria-label": "Outcomes" }, this.chips),
      el("div.tools", ...more, find, sight, folds, this.byStep, this.error, zoom, this.now),
    );
  }

  chip(name) {
    const { rows } = this.timeline,
      number = el("span.tl-number");
    const chip = el.button(
      {
        type: "button",
        class: "outcome o-" + name,
        "aria-pressed": "false",
        title: "only what is " + OUTCOMES[name].word,
        on: {
          click: () => {
            if (!rows.outcomes.delete(name)) rows.outcomes.add(name);
            this.timeline.relist();
          },
        },
      },
      el.i({ "aria-hidden": "true" }, OUTCOMES[name].icon),
      OUTCOMES[name].word + " ",
      number,
    );
    chip.number = number;
    chip.outcome = name;
    return chip;
  }
  fold(open) {
    this.timeline.rows.foldAll(open);
    this.timeline.relist();
  }

  draw() {
    const { history, rows, window, host, list } = this.timeline;
    if (host.isLive) this.drawNow(window.follows);
    // counting takes a while, zooming changes nothing of it
    if (this.drawn === list.items && this.revision === history.revision) return;
    this.drawn = list.items;
    this.revision = history.revision;
    const counts = rows.counts();
    for (const chip of this.chips) {
      const text = String(counts[chip.outcome]);
      if (chip.number.textContent !== text) chip.number.textContent = text;
      chip.hidden = !counts[chip.outcome] && !rows.outcomes.has(chip.outcome);
      chip.setAttribute("aria-pressed", String(rows.outcomes.has(chip.outcome)));
    }
    const all = rows.goals.length,
      shown = list.items.filter(({ kind }) => kind === "goal").length,
      text = (rows.filters ? shown + " of " : "") + all + (all === 1 ? " goal" : " goals");
    if (this.count.textContent !== text) this.count.textContent = text;
    this.error.hidden = !this.timeline.marks.length;
  }
  drawNow(follows) {
    this.now.setAttribute("aria-pressed", String(follows));
    this.now.classList.toggle("primary", !follows);
    const word = follows ? "Following" : "Back to now";
    if (this.now.textContent !== word) this.now.textContent = word;
  }
}
