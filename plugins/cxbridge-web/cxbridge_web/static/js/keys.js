// Keys that work in all views, and the help with all keys.
import { button, el } from "cx/dom.js";

// keys and their meanings, for the help
const EVERYWHERE = {
  "Ctrl K": "search over everything",
  "/": "search in the view",
  p: "pause and resume",
  l: "copy the address of this view, selection and moment",
  o: "open a recording",
  ", .": "a recording: one step back, one step forward",
  Esc: "leave the search",
  "?": "this help",
};
const GROUPS = {
  Timeline: {
    "+ - w s": "zoom",
    "a d": "pan; also Shift ← →",
    0: "the whole run",
    f: "zoom to the selection",
    "e E": "the next error, the previous error",
    n: "the newest moment, and follow it",
    Backspace: "up one level, from a goal to the story of the run",
  },
  "Lists and trees": { "↑ ↓": "walk; also Page and Home, End", "← →": "close and open", Enter: "choose" },
  "Plot and World": {
    "← → ↑ ↓": "the cursor, or the map",
    "+ - 0": "zoom, and show all",
    Enter: "choose the moment",
  },
};

const group = (title, rows) =>
  el.section(
    el.h3(title),
    el(
      "dl.pairs",
      rows.map(([key, about]) => [el.dt(el.kbd(key)), el.dd(about)]),
    ),
  );

/**
 * Listen to the keys of the page, and fill the help.
 * @param views pairs of name and title, in the order of tabs
 */
export function keys(app, views) {
  const help = document.getElementById("help"),
    viewKeys = views.slice(0, 9).map(([, title], at) => [String(at + 1), title]);
  help.append(
    el("h2#help-title", "Keys"),
    el(
      "div.key-groups",
      group("Everywhere", [...viewKeys, ...Object.entries(EVERYWHERE)]),
      Object.entries(GROUPS).map(([title, rows]) => group(title, Object.entries(rows))),
    ),
    el.form(
      { method: "dialog" },
      button("Close", () => help.close(), { class: "primary" }),
    ),
  );

  const press = (id) => document.getElementById(id).click();
  const find = () => document.querySelector("#main .find")?.select();
  const actions = {
    "/": find,
    "?": () => help.showModal(),
    p: () => app.recording || press("pause"),
    l: () => press("copy-link"),
    o: () => (app.recording && !app.runs) || press("open-recording"),
    ",": () => app.recording?.step(-1),
    ".": () => app.recording?.step(1),
  };
  const isTyped = (node) =>
    node.closest("input, textarea, select, [contenteditable]") && !["checkbox", "range"].includes(node.type);
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (isTyped(event.target)) {
      if (event.key === "Escape") event.target.blur();
      return;
    }
    const view = views[Number(event.key) - 1];
    if (view) location.hash = "#/" + view[0];
    else if (Object.hasOwn(actions, event.key)) actions[event.key]();
    else return;
    event.preventDefault();
  });
}
