// One rule: where it is, its source, why it has not fired.
import { el } from "cx/dom.js";
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
    env = app.env,
    why = whyBox(app, "rule", rule.name, env, { button: { id: "why-rule" }, box: { id: "why-text" } });
  const place = el("p.dim");
  let found = rule;
  function drawPlace() {
    place.replaceChildren(
      [
        rule.module,
        found && found.file ? found.file + ":" + found.line : "",
        found && found.core ? "CX core" : "",
        rule.salience ? "salience " + rule.salience : "",
        firings ? "fired " + firings + "×" : "",
      ]
        .filter(Boolean)
        .join(" · "),
    );
  }
  drawPlace();
  constructText(app, env, "defrule", rule.name).then(
    (construct) => {
      if (!construct) {
        source.replaceChildren(
          el(
            "p.dim",
            app.recording
              ? "The recording has no file with this rule."
              : "No file that can be read has this rule.",
          ),
        );
        return;
      }
      found = construct;
      drawPlace();
      source.replaceChildren(
        el.h3("Source"),
        el(
          "pre.source",
          { tabindex: "0", "aria-label": "source of " + rule.name },
          highlighted(construct.text),
        ),
      );
    },
    () => {}, // where it is said already
  );
  const nodes = [el("div.detail-head", back, el.h2(rule.name), why.button), place, why.box, source];
  function update(known, count) {
    rule = known;
    firings = count;
    drawPlace();
  }
  return { nodes, update };
}
