// Search over everything: Ctrl-K, words, arrows, Enter.
import { button, el } from "cx/dom.js";
import { asked, entries, score } from "cx/palette/sources.js";

const MOST = 60,
  MOST_OF_GROUP = 12;

export function palette(app, views) {
  const input = el("input", {
    type: "search",
    id: "palette-input",
    role: "combobox",
    "aria-expanded": "true",
    "aria-controls": "palette-list",
    "aria-label": "Search goals, facts, rules, skills, interfaces, log lines, views",
    placeholder: "Goals, facts, rules, skills, interfaces, log lines, views",
    spellcheck: "false",
    autocomplete: "off",
  });
  const list = el("div", { id: "palette-list", role: "listbox", "aria-label": "Found" }),
    count = el("p", { class: "dim small", role: "status" });
  const dialog = el("dialog", { id: "palette", "aria-label": "Search over everything" }, input, list, count);
  document.body.append(dialog);
  let found = { rules: [], interfaces: [], skills: [], facts: [] },
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
      groups = new Map(),
      best = [];
    let all = 0;
    for (const entry of entries(app, views, found)) {
      const points = words.length ? score(entry, words) : Number(entry.group === "View");
      if (!points) continue;
      all += 1;
      const group = (groups.get(entry.group) || 0) + 1;
      groups.set(entry.group, group);
      if (group <= MOST_OF_GROUP * 5) best.push({ entry, points });
    }
    best.sort((a, b) => b.points - a.points);
    const taken = new Map();
    shown = best
      .map((each) => each.entry)
      .filter((entry) => {
        const number = (taken.get(entry.group) || 0) + 1;
        taken.set(entry.group, number);
        return number <= MOST_OF_GROUP;
      })
      .slice(0, MOST);
    list.replaceChildren(
      ...shown.map((entry, number) =>
        el(
          "div",
          { role: "option", id: "found-" + number, class: "found", on: { click: () => choose(number) } },
          el("span", { class: "kind" }, entry.group),
          el("span", { class: "main-text" }, entry.text),
          el("span", { class: "dim small" }, entry.more),
        ),
      ),
    );
    count.textContent = words.length
      ? all > shown.length
        ? shown.length + " of " + all + " are shown"
        : all
          ? all + " found"
          : "Nothing is found"
      : "Enter opens, Esc closes";
    mark(0);
  }
  function choose(number) {
    const entry = shown[number];
    if (!entry) return;
    dialog.close();
    location.hash = entry.href;
  }
  input.addEventListener("input", draw);
  input.addEventListener("keydown", (event) => {
    if (event.key === "ArrowDown") mark(at + 1);
    else if (event.key === "ArrowUp") mark(at - 1);
    else if (event.key === "Enter") choose(at);
    else if (event.key === "Escape")
      dialog.close(); // a field for searches would only be emptied
    else return;
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
