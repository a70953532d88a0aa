// One rule: where it is, its source, why it has not fired.
import { el, note, refill } from "cx/dom.js";
import { whyBox } from "cx/why.js";
import { constructText } from "cx/clips/constructs.js";
import { highlighted } from "cx/clips/source.js";

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
  // why a source cannot be read is told with the rule itself
  constructText(app, app.env, "defrule", rule.name).then(show, () => {});
  const head = el("div.detail-head", back, el.h2(rule.name), why.button);
  return { nodes: [head, place, why.box, source], update };
}
