// A fact to be changed in its place, slot by slot, or retracted.
import { part, patch, post, remove } from "cx/api.js";
import { parseFact } from "cx/clips/text.js";
import { button, el } from "cx/dom.js";

/** @param done called after something was changed, with the index that the fact has now; null: it is gone */
export function factForm(app, env, fact, done) {
  const parsed = parseFact(fact.text),
    inputs = new Map(),
    path = "cxbridge/facts/" + fact.index + "?env=" + part(env);
  let whole = null;
  const fields = el("div.fields");
  if (parsed && parsed.slots && parsed.slots.size) {
    for (const [name, text] of parsed.slots) {
      const input = el.input({
        type: "text",
        spellcheck: "false",
        autocomplete: "off",
        autocapitalize: "off",
        value: text,
        placeholder: "nothing",
      });
      inputs.set(name, input);
      fields.append(el.label(el.span(name), input));
    }
  } else {
    whole = el.textarea({ rows: 4, spellcheck: "false", "aria-label": "fact" });
    whole.value = fact.text;
    fields.append(whole);
  }

  async function change() {
    const slots = Object.fromEntries(
      [...inputs]
        .filter(([name, input]) => input.value.trim() !== parsed.slots.get(name))
        .map(([name, input]) => [name, input.value.trim()]),
    );
    if (!Object.keys(slots).length) {
      app.toast("Nothing is changed yet");
      return;
    }
    const answer = await patch(path, { slots });
    app.toast("f-" + fact.index + " is now f-" + answer.index);
    done(answer.index);
  }
  /** A fact without slots: asserted before the old one goes, so that a text that is not a fact costs nothing. */
  async function replace() {
    const text = whole.value.trim();
    if (text === fact.text) {
      app.toast("Nothing is changed yet");
      return;
    }
    const answer = await post("cxbridge/facts", { fact: text, env });
    await remove(path);
    app.toast("f-" + fact.index + " is now f-" + answer.index);
    done(answer.index);
  }
  const form = el(
    "form#edit-fact.edit",
    fields,
    el(
      "div.tools",
      app.gate(el("button.primary", { type: "submit" }, "Change")),
      app.gate(
        button(
          "Retract",
          () =>
            app.attempt(async () => {
              await remove(path);
              app.toast("Retracted f-" + fact.index);
              done(null);
            }),
          { class: "danger" },
        ),
      ),
      app.whyNot ? el("span.dim.small", app.whyNot) : null,
    ),
    el("p.dim.small", 'Values as CLIPS writes them: FINISHED, "a text", a b c. It gets a new index.'),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    app.attempt(whole ? replace : change);
  });
  return form;
}
