// CLIPS environments: which one is looked at (all views agree on it), and what the API tells of any of them.
import { get, part } from "cx/api.js";
import { MODELS } from "cx/clips/text.js";
import { el } from "cx/dom.js";
import { MAIN_ENV } from "cx/model.js";

/**
 * Goals, plans or the domain of an environment. The API has those of the executive's own; of others they
 * are made of its facts.
 * @param what goals, plans, domain-facts, domain-objects, domain-predicates or domain-operators
 */
export async function readOf(env, what) {
  if (env === MAIN_ENV) return get("clips-executive/" + what);
  const { templates, make } = MODELS[what];
  const lists = await Promise.all(
    templates.map((template) => get("clips/" + part(env) + "/facts?formatted=true&template=" + template)),
  );
  const facts = new Map(
    lists.flat().map((fact) => [fact.index, { template: fact.template_name, text: fact.formatted }]),
  );
  return make([...facts.values()]);
}

/**
 * A choice among the environments; hidden while there is only one.
 * @param changed called when another one was chosen, here or in another view
 * @param all whether all of them can be looked at together
 */
export function envSelect(app, changed, { all = false } = {}) {
  const select = el("select", { class: "env", "aria-label": "environment" });
  let drawn = "";
  select.addEventListener("change", () => {
    app.chosenEnv = select.value;
    changed();
  });
  select.renew = () => {
    const names = app.environments,
      now = all ? app.chosenEnv : app.env,
      sign = names.join("\n") + "\n\n" + now;
    select.hidden = names.length < 2;
    if (sign === drawn) return;
    drawn = sign;
    select.replaceChildren(
      all ? el("option", { value: "", selected: !now }, "all environments") : "",
      ...names.map((name) => el("option", { value: name, selected: name === now }, name)),
    );
  };
  let wasThere = false;
  const stop = app.onChange(() => {
    if (wasThere && !select.isConnected) {
      stop();
      return;
    }
    wasThere = select.isConnected;
    select.renew();
  });
  select.renew();
  return select;
}
