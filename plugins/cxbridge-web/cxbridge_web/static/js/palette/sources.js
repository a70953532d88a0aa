// What the search over everything looks through. Each entry: {group, text, more, href}.
import { get, part } from "cx/api.js";
import { MAIN_ENV } from "cx/model.js";
import { parseCall } from "cx/skills/parameters.js";

const MOST_LINES = 5000; // of the log: the latest

/** What has to be asked for: rules, facts of the executive, interfaces, skills. Those that fail are left out. */
export async function asked(app) {
  if (app.recording) return { rules: [], interfaces: [], skills: [], facts: [] };
  const of = (path) => get(path).catch(() => []);
  const [rules, interfaces, skills, facts] = await Promise.all([
    of("cxbridge/rules?env=" + part(app.env)),
    of("blackboard/interfaces"),
    of("skiller/skills"),
    of("clips/" + part(app.env) + "/facts?formatted=true"),
  ]);
  return { rules, interfaces, skills, facts };
}

/** All entries of what is known now. */
export function* entries(app, views, found) {
  const { model } = app;
  for (const [name, title] of views) yield { group: "View", text: title, more: "", href: "#/" + name };
  for (const goal of [...model.goals.values(), ...model.gone.values()])
    yield {
      group: "Goal",
      text: goal.id,
      more: [goal.cls, goal.mode, goal.outcome === "UNKNOWN" ? "" : goal.outcome].join(" "),
      href: "#/goals/" + part(goal.key),
    };
  const rules = new Set(found.rules.map((rule) => rule.name));
  for (const key of model.firings.keys()) rules.add(key.slice(key.indexOf(" ") + 1));
  for (const name of rules)
    yield { group: "Rule", text: name, more: "", href: "#/clips/rules/" + part(name) };
  const skills = new Set(found.skills.map((skill) => skill.name));
  for (const call of model.calls) {
    const parsed = parseCall(call.text);
    if (parsed) skills.add(parsed.skill);
  }
  for (const name of skills) yield { group: "Skill", text: name, more: "", href: "#/skills/" + part(name) };
  const uids = new Set(found.interfaces.map((each) => each.type + "::" + each.id));
  for (const uid of model.interfaces.keys()) uids.add(uid);
  for (const uid of uids)
    yield { group: "Interface", text: uid, more: "", href: "#/blackboard/" + part(uid) };
  const facts = new Map(found.facts.map((fact) => [fact.index, fact.formatted]));
  for (const fact of model.factsOf(app.env || MAIN_ENV).values()) facts.set(fact.index, fact.text);
  for (const [index, text] of facts)
    yield { group: "Fact", text, more: "f-" + index, href: "#/clips/facts/f-" + index };
  for (const line of model.log.slice(-MOST_LINES).reverse())
    yield {
      group: "Log",
      text: line.text.split("\n", 1)[0],
      more: line.component,
      href: "#/log?time=" + line.time,
    };
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
