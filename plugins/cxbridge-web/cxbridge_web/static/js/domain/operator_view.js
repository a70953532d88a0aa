// One operator: its precondition with what is true and false now, and its effects, for arguments that can be
// chosen.
import { button, dim, el, field, note, refill, textInput } from "cx/dom.js";
import { evaluated, formulaTree } from "cx/domain/formula.js";

function effectItem({ positive, atom, condition }, binding, facts) {
  const holds = condition && evaluated(condition, binding, facts);
  return el.li(
    el.b({ class: positive ? "plus" : "minus" }, positive ? "+" : "−"),
    el("span.hear-only", positive ? "becomes true: " : "becomes false: "),
    " ",
    el.code(evaluated(atom, binding, new Set()).text),
    holds && el.div(dim("when"), formulaTree(holds)),
  );
}
const truth = (satisfied) =>
  satisfied === null
    ? "with the arguments above it can be evaluated"
    : satisfied
      ? "is true now"
      : "is false now";

/**
 * @param domain of readDomain()
 * @param binding Map parameter -> argument; what is typed goes into it
 * @param calls of this operator in plans: [{label, values}]
 */
export function operatorView(domain, operator, binding, calls) {
  const body = el("div#operator-state"),
    { parameters, precondition, effects, exogenous, waitsForSensing } = operator;
  function draw() {
    const known = precondition && evaluated(precondition, binding, domain.facts),
      items = effects.map((effect) => effectItem(effect, binding, domain.facts));
    refill(
      body,
      el.h3("Precondition ", known && dim(truth(known.satisfied))),
      known ? formulaTree(known) : note("none: it is always applicable"),
      el.h3("Effects"),
      items.length ? el("ul.effects", items) : note("none"),
    );
  }
  const inputs = parameters.map(({ name }) => {
    const input = textInput({ list: "domain-values", value: binding.get(name) || "" });
    input.addEventListener("input", () => {
      if (input.value.trim()) binding.set(name, input.value.trim());
      else binding.delete(name);
      draw();
    });
    return input;
  });
  function take(values) {
    for (const [at, input] of inputs.entries()) {
      input.value = values[at] || "";
      binding.set(parameters[at].name, input.value);
    }
    draw();
  }
  draw();
  const about = [
    exogenous && "exogenous: the agent does not execute the operator",
    waitsForSensing && "waits until sensed effects are observed",
  ];
  return el.div(
    note(about.filter(Boolean).join(" · ")),
    calls.length > 0 &&
      el(
        "p.tools",
        dim("in plans:"),
        calls.map(({ label, values }) => button(label, () => take(values))),
      ),
    el(
      "div.fields",
      parameters.map(({ name, type }, at) => field("?" + name + " - " + type, inputs[at])),
    ),
    el(
      "datalist#domain-values",
      domain.values.map((value) => el.option({ value })),
    ),
    body,
  );
}
