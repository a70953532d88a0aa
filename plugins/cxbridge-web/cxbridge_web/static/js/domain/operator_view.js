// One operator: its precondition with what is true and false now, and its effects, for arguments that can be
// chosen.
import { el } from "cx/dom.js";
import { evaluated, formulaTree } from "cx/domain/formula.js";

/** What an atom says with these arguments. */
const atomText = (atom, binding) => evaluated(atom, binding, new Set()).text;

function effectItem(effect, binding, facts) {
  const holds = effect.condition ? evaluated(effect.condition, binding, facts) : null;
  return el.li(
    el.b({ class: effect.positive ? "plus" : "minus" }, effect.positive ? "+" : "−"),
    el("span.hear-only", effect.positive ? "becomes true: " : "becomes false: "),
    " ",
    el.code(atomText(effect.atom, binding)),
    holds ? el.div(el("span.dim", "when"), formulaTree(holds)) : null,
  );
}

/**
 * @param domain of readDomain()
 * @param binding Map parameter -> argument; what is typed goes into it
 * @param calls of this operator in plans: [{label, values}]
 */
export function operatorView(domain, operator, binding, calls) {
  const body = el("div#operator-state");
  function draw() {
    const known = operator.precondition ? evaluated(operator.precondition, binding, domain.facts) : null;
    body.replaceChildren(
      el.h3(
        "Precondition ",
        known
          ? el(
              "span.dim",
              known.satisfied === null
                ? "with the arguments above it can be evaluated"
                : known.satisfied
                  ? "is true now"
                  : "is false now",
            )
          : null,
      ),
      known ? formulaTree(known) : el("p.dim", "none: it is always applicable"),
      el.h3("Effects"),
      operator.effects.length
        ? el(
            "ul.effects",
            operator.effects.map((effect) => effectItem(effect, binding, domain.facts)),
          )
        : el("p.dim", "none"),
    );
  }
  const inputs = operator.parameters.map(({ name, type }) => {
    const input = el.input({
      type: "text",
      list: "domain-values",
      value: binding.get(name) || "",
      spellcheck: "false",
      autocomplete: "off",
    });
    input.addEventListener("input", () => {
      if (input.value.trim()) binding.set(name, input.value.trim());
      else binding.delete(name);
      draw();
    });
    return [name, type, input];
  });
  function take(values) {
    for (const [at, [name, , input]] of inputs.entries()) {
      input.value = values[at] || "";
      binding.set(name, input.value);
    }
    draw();
  }
  draw();
  return el.div(
    el(
      "p.dim",
      [
        operator.exogenous ? "exogenous: somebody else carries it out" : "",
        operator.waitsForSensing ? "waits until sensed effects are observed" : "",
      ]
        .filter(Boolean)
        .join(" · "),
    ),
    calls.length
      ? el(
          "p.tools",
          el("span.dim", "in plans:"),
          calls.map((call) =>
            el.button({ type: "button", on: { click: () => take(call.values) } }, call.label),
          ),
        )
      : null,
    el(
      "div.fields",
      inputs.map(([name, type, input]) => el.label(el.span("?" + name + " - " + type), input)),
    ),
    el(
      "datalist#domain-values",
      domain.values.map((value) => el.option({ value })),
    ),
    body,
  );
}
