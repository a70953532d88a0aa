// Keys that work everywhere, and the help that tells of them.
import { button, el } from "cx/dom.js";

export function keys(app, views) {
  const help = document.getElementById("help");
  const rows = [
    ...views.slice(0, 9).map(([, title], at) => [String(at + 1), title]),
    ["Ctrl K", "search over everything"],
    ["/", "search in the view"],
    ["↑ ↓", "walk in a list"],
    ["← →", "close and open what is in a tree"],
    ["p", "pause and resume"],
    [", .", "a recording: one step back, one step on"],
    ["o", "open a recording"],
    ["Esc", "leave the search"],
    ["?", "this help"],
  ];
  help.append(
    el("h2", { id: "help-title" }, "Keys"),
    el(
      "dl",
      { class: "pairs" },
      rows.map(([key, what]) => [el("dt", {}, el("kbd", {}, key)), el("dd", {}, what)]),
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
    else if (event.key === "o" && (!app.recording || app.runs))
      document.getElementById("open-recording").click();
    else if ((event.key === "," || event.key === ".") && app.recording)
      app.recording.step(event.key === "." ? 1 : -1);
    else return;
    event.preventDefault();
  });
}
