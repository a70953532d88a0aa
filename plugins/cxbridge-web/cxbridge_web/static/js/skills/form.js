// A form that calls one skill: a field for each parameter that is known.
import { el, field, form, submit, textInput } from "cx/dom.js";
import { skillString } from "cx/skills/parameters.js";

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
