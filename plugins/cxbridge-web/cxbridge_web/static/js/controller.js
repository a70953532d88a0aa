// Who has exclusive control of a Skiller, in words. The interface has a serial number only; that it is an
// executive of this daemon, its facts say.
import { get, part } from "cx/api.js";
import { valuesOf, parseFact } from "cx/clips/text.js";
import { MAIN_ENV } from "cx/model.js";

const TEMPLATE = "skiller-control";

const controls = (text, skiller) => {
  const fact = parseFact(text);
  return (
    fact &&
    fact.slots &&
    valuesOf(fact.slots.get("skiller"))[0] === skiller &&
    fact.slots.get("acquired") === "TRUE"
  );
};
const nameOf = (env) => (env === MAIN_ENV ? "executive" : "executive " + env);

/**
 * @param serial of the interface's field exclusive_controller
 * @returns "" when nobody controls it; "executive", when an executive of this daemon does
 */
export async function controllerName(app, skiller, serial) {
  if (!serial) return "";
  for (const env of app.environments.length ? app.environments : [MAIN_ENV]) {
    const texts = app.recording
      ? [...app.model.factsOf(env).values()].filter((fact) => fact.template === TEMPLATE)
      : await get("clips/" + part(env) + "/facts?formatted=true&template=" + TEMPLATE).catch(() => []);
    if (texts.some((fact) => controls(fact.text ?? fact.formatted, skiller))) return nameOf(env);
  }
  return "another client (" + serial.slice(0, 8) + ")";
}
