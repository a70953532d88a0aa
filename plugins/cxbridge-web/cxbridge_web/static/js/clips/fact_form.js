// A fact to be changed in its place, slot by slot, or retracted.
import { part, patch, post, remove } from "cx/api.js";
import { parseFact } from "cx/clips/text.js";
import { button, changeTools, el, field, form, textInput } from "cx/dom.js";

/** @param done called after something was changed, with the index that the fact has now; null: it is gone */
export function factForm(app, env, fact, done) {
  const slots = [...(parseFact(fact.text)?.slots ?? [])],
    inputs = slots.map(([name, text]) => [name, text, textInput({ value: text, placeholder: "nothing" })]),
    whole = el.textarea({ rows: 4, spellcheck: "false", "aria-label": "fact" }, fact.text),
    path = "cxbridge/facts/" + fact.index + "?env=" + part(env);

  async function change() {
    const changed = inputs
      .map(([name, before, input]) => [name, before, input.value.trim()])
      .filter(([, before, now]) => now !== before);
    if (!changed.length) return null;
    return patch(path, { slots: Object.fromEntries(changed.map(([name, , now]) => [name, now])) });
  }
  /** A fact without slots: asserted before the old one goes, so that a text that is not a fact costs nothing. */
  async function replace() {
    const text = whole.value.trim();
    if (text === fact.text) return null;
    const answer = await post("cxbridge/facts", { fact: text, env });
    await remove(path);
    return answer;
  }
  const submitted = () =>
    app.attempt(async () => {
      const answer = await (inputs.length ? change() : replace());
      if (!answer) return app.toast("Nothing is changed yet");
      app.toast("f-" + fact.index + " is now f-" + answer.index);
      return done(answer.index);
    });
  const retract = () =>
    app.attempt(async () => {
      await remove(path);
      app.toast("Retracted f-" + fact.index);
      done(null);
    });
  return form(
    "#edit-fact.edit",
    submitted,
    el("div.fields", inputs.length ? inputs.map(([name, , input]) => field(name, input)) : whole),
    changeTools(app, "Change", app.gate(button("Retract", retract, { class: "danger" }))),
    el("p.dim.small", 'Values as CLIPS writes them: FINISHED, "a text", a b c. It gets a new index.'),
  );
}
