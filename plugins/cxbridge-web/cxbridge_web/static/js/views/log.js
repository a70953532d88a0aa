// The log, with levels and search. At its end it follows.
import { checkbox, clockText, el, none, paced, panel, search } from "cx/dom.js";
import { VirtualList } from "cx/virtual.js";

export const tab = { title: "Log", order: 80 };
export const moment = "own";
export const kinds = [];
const LEVELS = [
  ["D", "debug"],
  ["I", "info"],
  ["W", "warning"],
  ["E", "error"],
];
const shownLevels = new Set(["I", "W", "E"]);

export function open(root, app) {
  let wanted = "",
    follow = true,
    chosen = null;
  const list = new VirtualList({
    label: "Log",
    height: "--row-log",
    key: (line) => String(line.number),
    sign: () => "",
    draw: (line) => [
      el("span.dim.n", clockText(line.time, 3)),
      el.b({ class: "lv lv-" + line.level, title: levelName(line.level) }, line.level),
      el("span.from.dim", line.component),
      el("span.text", line.text.split("\n", 1)[0]),
    ],
    select: (line) => {
      chosen = line;
      follow = false;
      drawChosen();
    },
  });
  list.box.classList.add("mono");
  const whole = el("div.log-whole", { hidden: true });
  const empty = el.div({ hidden: true });
  const counter = el("span.dim.count");
  const boxes = LEVELS.map(([level, name]) =>
    checkbox(name, shownLevels.has(level), (on) => {
      if (on) shownLevels.add(level);
      else shownLevels.delete(level);
      draw();
    }),
  );
  const following = checkbox("follow", true, (on) => {
    follow = on;
    draw();
  });
  list.box.addEventListener(
    "scroll",
    () => {
      if (list.atEnd === follow) return;
      follow = list.atEnd;
      following.firstChild.checked = follow;
    },
    { passive: true },
  );
  root.append(
    panel(
      "Log",
      [
        counter,
        el("fieldset.levels", { "aria-label": "levels" }, boxes),
        search("Search the log", (text) => {
          wanted = text;
          draw();
        }),
        following,
      ],
      empty,
      list.box,
      whole,
    ),
  );

  function levelName(level) {
    return (LEVELS.find(([each]) => each === level) || ["", level])[1];
  }
  function drawChosen() {
    whole.hidden = !chosen;
    if (chosen)
      whole.replaceChildren(
        el("p.dim", clockText(chosen.time, 6) + "  " + levelName(chosen.level) + "  " + chosen.component),
        el.pre(chosen.text),
      );
  }
  function draw() {
    const { log } = app.model;
    const items = log.filter(
      (line) =>
        shownLevels.has(line.level) &&
        (!wanted || (line.component + ": " + line.text).toLowerCase().includes(wanted)),
    );
    counter.textContent =
      items.length === log.length ? String(log.length) : items.length + " of " + log.length;
    empty.hidden = items.length > 0;
    list.box.hidden = !items.length;
    if (!items.length)
      empty.replaceChildren(
        none(
          log.length ? "No line matches" : "Nothing logged yet",
          log.length ? "Other levels, or another search?" : "",
        ),
      );
    const stay = follow;
    list.set(items);
    if (stay) list.toEnd();
  }
  /** Show the line of the moment that is selected. */
  function toMoment(time) {
    if (time === null) return;
    const line = list.items.findLast((each) => each.time <= time) || list.items[0];
    if (!line) return;
    follow = false;
    following.firstChild.checked = false;
    chosen = line;
    list.mark(String(line.number), true);
    drawChosen();
  }
  const onSelect = ({ detail: { changed, time } }) => {
    if (changed.includes("time") && !app.recording) toMoment(time);
  };
  app.addEventListener("select", onSelect);
  const soon = paced(draw, () => app.model.log.length);
  const stop = app.model.onChange((topics) => {
    if (topics.has("log")) soon();
  });
  draw();
  return {
    go() {
      if (!app.recording) toMoment(app.selection.value.time);
    },
    close() {
      stop();
      app.removeEventListener("select", onSelect);
      soon.stop();
      list.gone();
    },
  };
}
