// The parameters of skills: their names are in the templates of the action mapping, their last values in
// calls; a form to call a skill has a field for each.
import { el, field, form, submit, textInput } from "cx/dom.js";

const CALL = /^\s*([\w-]+)\s*\{(.*)\}\s*$/s;
const PAIR = /([\w-]+)\s*=\s*("(?:\\.|[^"\\])*"|[^,\s]+(?:\s*\([^)]*\))?)\s*(?:,|$)/gs;
const BARE = /^(-?\d+(\.\d+)?|true|false|nil)$/;

/** A skill string taken apart: {skill, values: Map name -> text as written}; null: it is not a simple call. */
export function parseCall(text) {
  const found = CALL.exec(text || "");
  return found
    ? {
        skill: found[1],
        values: new Map([...found[2].matchAll(PAIR)].map(([, name, value]) => [name, value])),
      }
    : null;
}

/** The templates of all specs of a configuration: skill -> Map parameter -> its template. */
export function mappedSkills(config) {
  const skills = new Map();
  for (const spec of Object.values(config?.["clips-executive"]?.specs || {}))
    for (const template of Object.values(spec?.["action-mapping"] || {})) {
      const call =
        typeof template === "string" && parseCall(template.replace(/\?\(([^)]*)\)(\w)/g, "?$1:$2"));
      if (call) skills.set(call.skill, new Map([...(skills.get(call.skill) || []), ...call.values]));
    }
  return skills;
}

/** The parameters of a skill: [{name, last}], `last` as it was written in the last call. */
export function parametersOf(skill, mapped, calls) {
  const last = new Map([...(mapped.get(skill) || [])].map(([name]) => [name, ""]));
  for (const { text } of calls) {
    const call = parseCall(text);
    if (call && call.skill === skill) for (const [name, value] of call.values) last.set(name, value);
  }
  return [...last].map(([name, value]) => ({ name, last: value }));
}

/** A typed value as a skill string has it: numbers and truth values stay, other texts are quoted. */
export function written(text) {
  const value = text.trim();
  return BARE.test(value) || /^".*"$/s.test(value) ? value : '"' + value.replace(/["\\]/g, "\\$&") + '"';
}

export const skillString = (skill, values) =>
  skill + "{" + values.map(([name, value]) => name + "=" + written(value)).join(", ") + "}";

/**
 * @param parameters of parametersOf()
 * @param call called with the skill string
 * @param isHeld whether another client controls the Skiller
 */
export function skillForm(app, skill, parameters, call, isHeld) {
  const inputs = parameters.map(({ name, last }) =>
      textInput({ name, value: last.replace(/^"(.*)"$/s, "$1") }),
    ),
    shown = el("code.dim");
  const given = () => inputs.filter(({ value }) => value.trim()).map(({ name, value }) => [name, value]),
    text = () => skillString(skill, given());
  const show = () => {
    shown.textContent = text();
  };
  const made = form(
    "#skill-form.skill-form",
    () => call(text()),
    inputs.length
      ? el(
          "div.fields",
          inputs.map((input) => field(input.name, input)),
        )
      : el(
          "p.dim.small",
          "No parameters are known: the action mapping names none, and it was not called yet.",
        ),
    el("div.tools", app.gate(submit("Call " + skill), isHeld), shown),
  );
  made.addEventListener("input", show);
  show();
  return made;
}
