// Search over everything: Ctrl-K, words, arrows, Enter.
import { button, el, refill, textInput } from "cx/dom.js";
import { asked, entries, score } from "cx/palette/sources.js";

const MOST = 60,
  MOST_OF_GROUP = 12,
  SCOPE = "Goals, facts, rules, skills, interfaces, log lines, views";

export function palette(app, views) {
  const input = textInput({
    type: "search",
    id: "palette-input",
    role: "combobox",
    "aria-expanded": "true",
    "aria-controls": "palette-list",
    "aria-label": "Search " + SCOPE.toLowerCase(),
    placeholder: SCOPE,
  });
  const list = el("div#palette-list", { role: "listbox", "aria-label": "Found" }),
    count = el("p.dim.small", { role: "status" }),
    dialog = el("dialog#palette", { "aria-label": "Search over everything" }, input, list, count);
  document.body.append(dialog);
  let found = {},
    shown = [],
    at = 0;

  function mark(next) {
    at = shown.length ? (next + shown.length) % shown.length : 0;
    for (const [number, row] of [...list.children].entries()) {
      row.setAttribute("aria-selected", String(number === at));
      if (number === at) row.scrollIntoView({ block: "nearest" });
    }
    if (shown.length) input.setAttribute("aria-activedescendant", "found-" + at);
    else input.removeAttribute("aria-activedescendant");
  }
  function draw() {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean),
      fitting = [];
    for (const entry of entries(app, views, found)) {
      const points = words.length ? score(entry, words) : Number(entry.group === "View");
      if (points) fitting.push({ entry, points });
    }
    const taken = {};
    shown = fitting
      .sort((a, b) => b.points - a.points)
      .map(({ entry }) => entry)
      .filter(({ group }) => (taken[group] = (taken[group] || 0) + 1) <= MOST_OF_GROUP)
      .slice(0, MOST);
    refill(list, shown.map(row));
    const all = fitting.length,
      told = all > shown.length ? shown.length + " of " + all + " are shown" : all + " found";
    count.textContent = words.length ? (all ? told : "Nothing is found") : "Enter opens, Esc closes";
    mark(0);
  }
  const row = ({ group, text, more }, number) =>
    el(
      "div.found",
      { role: "option", id: "found-" + number, on: { click: () => choose(number) } },
      el("span.kind", group),
      el("span.main-text", text),
      el("span.dim.small", more),
    );
  function choose(number) {
    if (!shown[number]) return;
    dialog.close();
    location.hash = shown[number].href;
  }
  const actions = {
    ArrowDown: () => mark(at + 1),
    ArrowUp: () => mark(at - 1),
    Enter: () => choose(at),
    Escape: () => dialog.close(), // a field for searches would only be emptied
  };
  input.addEventListener("input", draw);
  input.addEventListener("keydown", (event) => {
    if (!Object.hasOwn(actions, event.key)) return;
    actions[event.key]();
    event.preventDefault();
  });
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  function open() {
    if (dialog.open) return;
    input.value = "";
    draw();
    dialog.showModal();
    asked(app).then((answer) => {
      found = answer;
      if (dialog.open) draw();
    });
  }
  document.addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && !event.altKey && event.key.toLowerCase() === "k") {
      event.preventDefault();
      open();
    }
  });
  return button("Search", open, {
    id: "palette-open",
    class: "quiet",
    "aria-keyshortcuts": "Control+K",
    title: "Search over everything (Ctrl-K)",
  });
}
