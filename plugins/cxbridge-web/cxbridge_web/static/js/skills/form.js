// A form that calls one skill: a field for each parameter that is known.
import { el } from "cx/dom.js";
import { skillString } from "cx/skills/parameters.js";

/**
 * @param parameters of parametersOf()
 * @param call called with the skill string
 * @param isHeld whether somebody else controls the Skiller
 */
export function skillForm(app, skill, parameters, call, isHeld) {
  const fields = parameters.map(({ name, last }) => {
    const input = el.input({
      type: "text",
      name,
      value: last.replace(/^"(.*)"$/s, "$1"),
      spellcheck: "false",
      autocomplete: "off",
      autocapitalize: "off",
    });
    return [name, input];
  });
  const shown = el("code.dim");
  const text = () =>
    skillString(
      skill,
      fields.filter(([, input]) => input.value.trim()).map(([name, input]) => [name, input.value]),
    );
  const show = () => {
    shown.textContent = text();
  };
  const send = app.gate(el("button.primary", { type: "submit" }, "Call " + skill), isHeld);
  const form = el(
    "form#skill-form.skill-form",
    { on: { input: show } },
    fields.length
      ? el(
          "div.fields",
          fields.map(([name, input]) => el.label(el.span(name), input)),
        )
      : el(
          "p.dim.small",
          "No parameters are known: the action mapping names none, and it was not called yet.",
        ),
    el("div.tools", send, shown),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    call(text());
  });
  show();
  return form;
}
