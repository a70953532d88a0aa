// Names that can be plotted, for completion: those of the blackboard, of facts, and those seen in events.
import { get, part } from "cx/api.js";
import { parseFact } from "cx/clips/text.js";
import { fieldNames } from "cx/plot/names.js";

const MOST = 4000;

function ofEvents(events) {
  const found = new Set(["loop"]),
    templates = new Set();
  for (const event of events) {
    if (event.kind === "interface")
      for (const [field, value] of Object.entries(event.values))
        for (const name of fieldNames(event.uid, field, value)) found.add(name);
    if (event.kind === "fact" && !templates.has(event.env + event.template)) {
      templates.add(event.env + event.template);
      addSlots(found, event.env, event.text);
    }
    if (found.size > MOST) break;
  }
  return found;
}

function addSlots(found, env, text) {
  const fact = parseFact(text);
  if (fact && fact.slots)
    for (const slot of fact.slots.keys()) found.add(env + ":" + fact.template + "." + slot);
}

/** @returns a promise of the names, sorted */
export async function choices(app) {
  const found = app.recording ? ofEvents(app.recording.events) : new Set(["loop"]);
  if (!app.recording) {
    const [interfaces, facts] = await Promise.all([
      get("cxbridge/interfaces").catch(() => []),
      get("clips/" + part(app.env) + "/facts?formatted=true").catch(() => []),
    ]);
    for (const each of interfaces)
      for (const [field, value] of Object.entries(each.data))
        for (const name of fieldNames(each.type + "::" + each.id, field, value)) found.add(name);
    const templates = new Set();
    for (const fact of facts) {
      if (templates.has(fact.template_name)) continue;
      templates.add(fact.template_name);
      addSlots(found, app.env, fact.formatted);
    }
  }
  return [...found].sort();
}
