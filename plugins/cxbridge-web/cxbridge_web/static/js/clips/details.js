// One rule: where it is, its source, why it has not fired; one fact, to be changed in its place, or
// retracted.
import { part, patch, post, remove } from "cx/api.js";
import { constructText, highlighted } from "cx/clips/source.js";
import { parseFact } from "cx/clips/text.js";
import { button, changeTools, el, field, form, note, refill, textInput } from "cx/dom.js";
import { whyBox } from "cx/why.js";

/**
 * @param rule what is known: {name, module, file, line, salience}
 * @param firings how often it fired
 * @param back a node that leads back, on a telephone
 * @returns nodes; update: to be called with the rule and its firings when more is known, or it has fired
 */
export function ruleDetail(app, rule, firings, back) {
  const source = el("div#rule-source"),
    why = whyBox(app, "rule", rule.name, app.env, { button: { id: "why-rule" }, box: { id: "why-text" } }),
    place = note();
  let found = rule;
  function update(known, count) {
    const { file, line, core } = found || {},
      parts = [
        known.module,
        file && file + ":" + line,
        core && "CX core",
        known.salience && "salience " + known.salience,
        count && "fired " + count + "×",
      ];
    [rule, firings] = [known, count];
    place.textContent = parts.filter(Boolean).join(" · ");
  }
  function show(construct) {
    if (!construct)
      return refill(
        source,
        note(
          app.recording
            ? "The recording has no file with this rule."
            : "No file that can be read has this rule.",
        ),
      );
    found = construct;
    update(rule, firings);
    const about = { tabindex: "0", "aria-label": "source of " + rule.name };
    return refill(source, el.h3("Source"), el("pre.source", about, highlighted(construct.text)));
  }
  update(rule, firings);
  // the list of rules shows the error of the same request
  constructText(app, app.env, "defrule", rule.name).then(show, () => {});
  const head = el("div.detail-head", back, el.h2(rule.name), why.button);
  return { nodes: [head, place, why.box, source], update };
}

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
