// What the search over everything looks through. Each entry: {group, text, more, href}.
import { factsPath, get, part } from "cx/api.js";
import { MAIN_ENV } from "cx/model.js";
import { parseCall } from "cx/skills/parameters.js";

const MOST_LINES = 5000; // of the log: the latest

/** What has to be asked for: rules, facts of the executive, interfaces, skills. Those that fail are left out. */
export async function asked(app) {
  if (app.recording) return {};
  const paths = {
    rules: "cxbridge/rules?env=" + part(app.env),
    interfaces: "blackboard/interfaces",
    skills: "skiller/skills",
    facts: factsPath(app.env),
  };
  const answers = Object.entries(paths).map(async ([name, path]) => [name, await get(path).catch(() => [])]);
  return Object.fromEntries(await Promise.all(answers));
}

/** All entries of what is known now. */
export function* entries(app, views, { rules = [], interfaces = [], skills = [], facts = [] }) {
  const { model } = app,
    entry = (group, text, href, more = "") => ({ group, text, more, href: "#/" + href });
  for (const [name, title] of views) yield entry("View", title, name);
  for (const goal of [...model.goals.values(), ...model.gone.values()]) {
    const more = [goal.cls, goal.mode, goal.outcome === "UNKNOWN" ? "" : goal.outcome].join(" ");
    yield entry("Goal", goal.id, "goals/" + part(goal.key), more);
  }
  const fired = [...model.firings.keys()].map((key) => key.slice(key.indexOf(" ") + 1));
  for (const name of new Set([...rules.map((rule) => rule.name), ...fired]))
    yield entry("Rule", name, "clips/rules/" + part(name));
  const called = model.calls.flatMap(({ text }) => parseCall(text)?.skill ?? []);
  for (const name of new Set([...skills.map((skill) => skill.name), ...called]))
    yield entry("Skill", name, "skills/" + part(name));
  for (const uid of new Set([
    ...interfaces.map(({ type, id }) => type + "::" + id),
    ...model.interfaces.keys(),
  ]))
    yield entry("Interface", uid, "blackboard/" + part(uid));
  const texts = new Map(facts.map((fact) => [fact.index, fact.formatted]));
  for (const fact of model.factsOf(app.env || MAIN_ENV).values()) texts.set(fact.index, fact.text);
  for (const [index, text] of texts) yield entry("Fact", text, "clips/facts/f-" + index, "f-" + index);
  for (const line of model.log.slice(-MOST_LINES).reverse())
    yield entry("Log", line.text.split("\n", 1)[0], "log?time=" + line.time, line.component);
}

/** How well an entry fits words; 0: not at all. */
export function score(entry, words) {
  const text = entry.text.toLowerCase(),
    all = text + " " + entry.more.toLowerCase() + " " + entry.group.toLowerCase();
  let sum = 0;
  for (const word of words) {
    if (!all.includes(word)) return 0;
    sum += text === word ? 8 : text.startsWith(word) ? 4 : text.includes(word) ? 2 : 1;
  }
  return sum;
}
