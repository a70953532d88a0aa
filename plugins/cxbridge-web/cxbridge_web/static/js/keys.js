// Keys that work everywhere, and the help that tells of them.
import { button, el } from "cx/dom.js";

export function keys(app, views) {
  const help = document.getElementById("help");
  const groups = [
    [
      "Everywhere",
      ...views.slice(0, 9).map(([, title], at) => [String(at + 1), title]),
      ["Ctrl K", "search over everything"],
      ["/", "search in the view"],
      ["p", "pause and resume"],
      ["l", "copy the address of this view, selection and moment"],
      ["o", "open a recording"],
      [", .", "a recording: one step back, one step on"],
      ["Esc", "leave the search"],
      ["?", "this help"],
    ],
    [
      "Timeline",
      ["+ - w s", "zoom"],
      ["a d", "pan; also Shift ← →"],
      ["0", "the whole run"],
      ["f", "zoom to the selection"],
      ["e E", "the next error, the one before"],
      ["n", "the newest moment, and follow it"],
      ["Backspace", "up one level, from a goal to the story of the run"],
    ],
    [
      "Lists and trees",
      ["↑ ↓", "walk; also Page and Home, End"],
      ["← →", "close and open"],
      ["Enter", "choose"],
    ],
    [
      "Plot and World",
      ["← → ↑ ↓", "the cursor, or the map"],
      ["+ - 0", "zoom, and show all"],
      ["Enter", "choose the moment"],
    ],
  ];
  help.append(
    el("h2", { id: "help-title" }, "Keys"),
    el(
      "div",
      { class: "key-groups" },
      groups.map(([title, ...rows]) =>
        el(
          "section",
          {},
          el("h3", {}, title),
          el(
            "dl",
            { class: "pairs" },
            rows.map(([key, about]) => [el("dt", {}, el("kbd", {}, key)), el("dd", {}, about)]),
          ),
        ),
      ),
    ),
    el(
      "form",
      { method: "dialog" },
      button("Close", () => help.close(), { class: "primary" }),
    ),
  );

  const typing = (node) =>
    node.closest("input, textarea, select, [contenteditable]") &&
    node.type !== "checkbox" &&
    node.type !== "range";
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (typing(event.target)) {
      if (event.key === "Escape") event.target.blur();
      return;
    }
    const view = views[Number(event.key) - 1];
    if (view) location.hash = "#/" + view[0];
    else if (event.key === "/") {
      const input = document.querySelector("#main .find");
      if (input) {
        input.focus();
        input.select();
      }
    } else if (event.key === "?") help.showModal();
    else if (event.key === "p" && !app.recording) document.getElementById("pause").click();
    else if (event.key === "l") document.getElementById("copy-link").click();
    else if (event.key === "o" && (!app.recording || app.runs))
      document.getElementById("open-recording").click();
    else if ((event.key === "," || event.key === ".") && app.recording)
      app.recording.step(event.key === "." ? 1 : -1);
    else return;
    event.preventDefault();
  });
}
