// Who has exclusive control of a Skiller, in words. The interface has a serial number only; that it is an
// executive of this daemon, its facts say.
import { factsPath, get } from "cx/api.js";
import { valuesOf, parseFact } from "cx/clips/text.js";
import { MAIN_ENV } from "cx/model.js";

const TEMPLATE = "skiller-control";

function controls(text, skiller) {
  const slots = parseFact(text)?.slots;
  return slots && valuesOf(slots.get("skiller"))[0] === skiller && slots.get("acquired") === "TRUE";
}

/**
 * @param serial of the interface's field exclusive_controller
 * @returns "" when nobody controls it; "executive", when an executive of this daemon does
 */
export async function controllerName(app, skiller, serial) {
  if (!serial) return "";
  for (const env of app.environments.length ? app.environments : [MAIN_ENV]) {
    const facts = app.recording
      ? [...app.model.factsOf(env).values()].filter((fact) => fact.template === TEMPLATE)
      : await get(factsPath(env, TEMPLATE)).catch(() => []);
    if (facts.some((fact) => controls(fact.text ?? fact.formatted, skiller)))
      return env === MAIN_ENV ? "executive" : "executive " + env;
  }
  return "another client (" + serial.slice(0, 8) + ")";
}
