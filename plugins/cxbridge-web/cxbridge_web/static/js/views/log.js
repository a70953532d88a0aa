// The log with levels and search. At its end, the list follows new lines.
import { checkbox, clockText, el, note, refill } from "cx/dom.js";
import { ListPanel } from "cx/scaffold.js";

export const tab = { title: "Log", order: 80 };
export const moment = "own";
export const kinds = [];
const LEVELS = { D: "debug", I: "info", W: "warning", E: "error" };
const shownLevels = new Set(["I", "W", "E"]);

export function open(root, app) {
  let isFollowing = true;
  const wholeLine = el("div.log-whole", { hidden: true }), // the chosen line with all its text
    followBox = checkbox("follow", true, (on) => {
      isFollowing = on;
      draw();
    });
  const boxes = Object.entries(LEVELS).map(([level, name]) =>
    checkbox(name, shownLevels.has(level), (on) => {
      shownLevels[on ? "add" : "delete"](level);
      draw();
    }),
  );
  const page = new ListPanel(
    {
      title: "Log",
      find: "Search the log",
      before: el("fieldset.levels", { "aria-label": "levels" }, boxes),
      after: followBox,
      below: wholeLine,
      row: {
        height: "--row-log",
        key: (line) => String(line.number),
        sign: () => "",
        draw: (line) => [
          el("span.dim.n", clockText(line.time, 3)),
          el("b", { class: "lv lv-" + line.level, title: LEVELS[line.level] }, line.level),
          el("span.from.dim", line.component),
          el("span.text", line.text.split("\n", 1)[0]),
        ],
        select: choose,
      },
    },
    draw,
  );
  const { list, life } = page;
  list.box.classList.add("mono");
  root.append(page.panel);

  function setFollowing(on) {
    isFollowing = followBox.firstChild.checked = on;
  }
  const scrolled = () => list.atEnd === isFollowing || setFollowing(list.atEnd);
  life.listen(list.box, "scroll", scrolled, { passive: true });
  function choose({ time, level, component, text }) {
    setFollowing(false);
    wholeLine.hidden = false;
    refill(wholeLine, note([clockText(time, 6), LEVELS[level], component].join("  ")), el.pre(text));
  }
  function draw() {
    const { log } = app.model,
      items = log.filter(
        ({ level, component, text }) => shownLevels.has(level) && page.matches(component + ": " + text),
      ),
      mustFollow = isFollowing;
    page.show(items, log.length, "Nothing logged yet");
    if (mustFollow) list.toEnd();
  }
  /** Choose the last line at or before a moment of a live run, or else the first line. */
  function toMoment(time) {
    const line = time !== null && (list.items.findLast((item) => item.time <= time) || list.items[0]);
    if (!line || app.recording) return;
    list.mark(String(line.number), true);
    choose(line);
  }
  life.listen(app, "select", ({ detail: { changed, time } }) => {
    if (changed.includes("time")) toMoment(time);
  });
  const drawSoon = life.paced(draw, () => app.model.log.length);
  life.add(app.model.onChange((topics) => topics.has("log") && drawSoon()));
  draw();
  return {
    go() {
      toMoment(app.selection.value.time);
    },
    close: life.close,
  };
}
