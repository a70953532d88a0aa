// Search over everything: Ctrl-K, words, arrows, Enter.
import { escapePart, factsPath, get } from "cx/api.js";
import { button, el, refill, textInput } from "cx/dom.js";
import { MAIN_ENV, skillOf } from "cx/names.js";
import { goalText } from "cx/outcome.js";

const MOST = 60, // shown entries
  MOST_OF_GROUP = 12,
  SCOPE = "Goals, facts, rules, skills, interfaces, log lines, views";

/** Make the dialog, and return the button that opens it. @param views pairs of name and title */
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
  let answers = {}, // see readAnswers()
    shown = [], // the listed entries
    at = 0; // the index of the marked entry

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
    for (const entry of entries(app, views, answers)) {
      const points = words.length ? score(entry, words) : Number(entry.group === "View");
      if (points) fitting.push({ entry, points });
    }
    const groupSizes = {};
    // the filter counts the entries of each group while it goes through them
    shown = fitting
      .sort((a, b) => b.points - a.points)
      .map(({ entry }) => entry)
      .filter(({ group }) => (groupSizes[group] = (groupSizes[group] || 0) + 1) <= MOST_OF_GROUP)
      .slice(0, MOST);
    refill(list, shown.map(row));
    const total = fitting.length,
      countText = total > shown.length ? shown.length + " of " + total + " are shown" : total + " found";
    count.textContent = words.length ? (total ? countText : "Nothing is found") : "Enter opens, Esc closes";
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
    Escape: () => dialog.close(), // by default, Escape only empties a search field
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
    readAnswers(app).then((received) => {
      answers = received;
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

const MOST_LINES = 5000; // of the log: the latest

/** Read the lists {rules, interfaces, skills, facts} of a daemon; the list of a failed request is empty. */
export async function readAnswers(app) {
  if (app.recording) return {};
  const paths = {
    rules: "cxbridge/rules?env=" + escapePart(app.env),
    interfaces: "blackboard/interfaces",
    skills: "skiller/skills",
    facts: factsPath(app.env),
  };
  const answers = Object.entries(paths).map(async ([name, path]) => [name, await get(path).catch(() => [])]);
  return Object.fromEntries(await Promise.all(answers));
}

/** Yield everything that the search finds: {group, text, more (a second text), href}. */
export function* entries(app, views, { rules = [], interfaces = [], skills = [], facts = [] }) {
  const { model } = app,
    entry = (group, text, href, more = "") => ({ group, text, more, href: "#/" + href });
  for (const [name, title] of views) yield entry("View", title, name);
  for (const goal of [...model.goals.values(), ...model.gone.values()]) {
    const more = goal.cls + " " + goalText(goal);
    yield entry("Goal", goal.id, "goals/" + escapePart(goal.key), more);
  }
  const fired = [...model.firings.keys()].map((key) => key.slice(key.indexOf(" ") + 1));
  for (const name of new Set([...rules.map((rule) => rule.name), ...fired]))
    yield entry("Rule", name, "clips/rules/" + escapePart(name));
  const called = model.calls.map(({ text }) => skillOf(text));
  for (const name of new Set([...skills.map((skill) => skill.name), ...called]))
    yield entry("Skill", name, "skills/" + escapePart(name));
  for (const uid of new Set([
    ...interfaces.map(({ type, id }) => type + "::" + id),
    ...model.interfaces.keys(),
  ]))
    yield entry("Interface", uid, "blackboard/" + escapePart(uid));
  const texts = new Map(facts.map((fact) => [fact.index, fact.formatted]));
  for (const fact of model.factsOf(app.env || MAIN_ENV).values()) texts.set(fact.index, fact.text);
  for (const [index, text] of texts) yield entry("Fact", text, "clips/facts/f-" + index, "f-" + index);
  for (const line of model.log.slice(-MOST_LINES).reverse())
    yield entry("Log", line.text.split("\n", 1)[0], "log?time=" + line.time, line.component);
}

/**
 * The points of an entry for words, which all must occur in it: more for the beginning of its text; 0: no
 * match.
 */
export function score(entry, words) {
  const text = entry.text.toLowerCase(),
    fullText = text + " " + entry.more.toLowerCase() + " " + entry.group.toLowerCase();
  let sum = 0;
  for (const word of words) {
    if (!fullText.includes(word)) return 0;
    sum += text === word ? 8 : text.startsWith(word) ? 4 : text.includes(word) ? 2 : 1;
  }
  return sum;
}
