// CLIPS environments: the choice, which all views share, and the goals and plans of an environment.
import { factsPath, get } from "cx/api.js";
import { MODELS } from "cx/clips/text.js";
import { choice } from "cx/dom.js";
import { MAIN_ENV } from "cx/names.js";

/**
 * Read the goals or plans of an environment. The API has them for the executive's environment; for another
 * environment facts are read.
 * @param listName goals or plans
 */
export async function readModels(env, listName) {
  if (env === MAIN_ENV) return get("clips-executive/" + listName);
  const { templates, make } = MODELS[listName];
  return make(await readFacts(env, templates));
}

async function readFacts(env, templates) {
  const lists = await Promise.all(templates.map((template) => get(factsPath(env, template))));
  return lists.flat().map(({ formatted: text }) => ({ text }));
}

/**
 * A choice among the environments; hidden while there is only one environment.
 * @param changed called when another environment was chosen, here or in another view
 * @param hasAll whether "all environments" is a choice
 */
export function envSelect(app, changed, { hasAll = false } = {}) {
  const select = choice({ class: "env", "aria-label": "environment" }, (env) => {
    app.chosenEnv = env;
    changed();
  });
  select.renew = () => {
    const names = app.environments;
    select.hidden = names.length < 2;
    select.offer([...(hasAll ? [["", "all environments"]] : []), ...names], hasAll ? app.chosenEnv : app.env);
  };
  let wasThere = false; // the choice has been part of the page
  const stop = app.onChange(() => {
    // the view has been closed
    if (wasThere && !select.isConnected) stop();
    else select.renew();
    wasThere = select.isConnected;
  });
  select.renew();
  return select;
}
