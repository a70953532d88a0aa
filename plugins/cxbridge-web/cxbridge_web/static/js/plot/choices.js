// Names that can be plotted, for completion: those of the blackboard, of facts, and those seen in events.
import { factsPath, get } from "cx/api.js";
import { parseFact } from "cx/clips/text.js";
import { fieldNames } from "cx/plot/names.js";

const MOST = 4000;

/** The interfaces and facts of a daemon, as events. */
async function eventsOf(app) {
  const { env } = app,
    of = (path) => get(path).catch(() => []),
    [interfaces, facts] = await Promise.all([of("cxbridge/interfaces"), of(factsPath(env))]);
  return [
    ...interfaces.map(({ type, id, data }) => ({ kind: "interface", uid: type + "::" + id, values: data })),
    ...facts.map(({ template_name: template, formatted: text }) => ({ kind: "fact", env, template, text })),
  ];
}

/** @returns a promise of the names, sorted */
export async function choices(app) {
  const found = new Set(["loop"]),
    templates = new Set();
  for (const { kind, uid, values, env, template, text } of app.recording?.events ?? (await eventsOf(app))) {
    if (kind === "interface")
      for (const [field, value] of Object.entries(values))
        for (const name of fieldNames(uid, field, value)) found.add(name);
    const key = env + ":" + template;
    if (kind === "fact" && !templates.has(key)) {
      templates.add(key);
      for (const slot of parseFact(text)?.slots?.keys() ?? []) found.add(key + "." + slot);
    }
    if (found.size > MOST) break;
  }
  return [...found].sort();
}
