// The PDDL domain: facts, objects, predicates, operators.
import { part as segment } from "cx/api.js";
import { MODELS } from "cx/clips/text.js";
import { capital, backLink, checkbox, el, none, redraw, refill, tabs } from "cx/dom.js";
import { operatorView, readDomain, TEMPLATES } from "cx/domain/operators.js";
import { envSelect, readFacts, readOf } from "cx/env.js";
import { goTo, ListPanel } from "cx/scaffold.js";

export const tab = { title: "Domain", order: 40 };
export const kinds = ["fact"];
const SOON_MS = 1500,
  MOST_CALLS = 6;
const typed = (names, types) =>
  names.map((name, at) => "?" + name + (types[at] ? " - " + types[at] : "")).join(" ");
/** Each part: the name, the rest and a remark of a row. */
const PARTS = {
  facts: (each) => [each.name, each["param-values"].join(" ")],
  objects: (each) => [each.name, each.type],
  predicates: (each) => [
    each.name,
    typed(each["param-names"], each["param-types"]),
    each.sensed ? "sensed" : "",
  ],
  operators: ({ name, parameters, "wait-sensed": waits }) => [
    name,
    typed(...["name", "type"].map((key) => parameters.map((each) => each[key]))),
    waits ? "waits for sensing" : "",
  ],
};
const LINKS = Object.keys(PARTS).map((key) => ["#/domain/" + key, capital(key)]);

export function open(root, app) {
  let part = "facts",
    items = [],
    byName = true,
    chosen = "",
    domain = null,
    calls = [];
  const bindings = new Map(), // operator -> Map parameter -> argument
    detail = el("div#operator.detail", { hidden: true }),
    bar = el.div();
  const envs = envSelect(app, () => {
    items = [];
    draw();
    renew();
  });
  const page = new ListPanel(
    {
      title: "Domain",
      find: "Search the domain",
      before: envs,
      after: checkbox("by name", true, (on) => {
        byName = on;
        draw();
      }),
      above: bar,
      detail,
      row: {
        key: (item) => String(item.number),
        sign: (item) => item.line,
        draw: ({ name, rest, note }) => [
          el("code.main-text", el.b(name), rest ? " " + rest : ""),
          note ? el("span.dim.small", note) : null,
        ],
        select: ({ name }) => part === "operators" && goTo("#/domain/operators/" + segment(name)),
      },
    },
    draw,
  );
  root.append(page.split);

  const factsNow = () => [...app.model.factsOf(app.env).values()],
    pathOf = (name) => "domain-" + name;
  const { life } = page;
  const read = page.reader(async () => {
    const asked = part,
      { env } = app,
      answer = await readOf(env, pathOf(asked));
    if (asked !== part || env !== app.env) return false;
    return itemsAre(answer);
  }, SOON_MS);
  const readDetails = life.reader(async () => {
    if (part !== "operators") return;
    const { env, recording } = app;
    calls = recording ? MODELS.plans.make(factsNow()) : await readOf(env, "plans");
    domain = readDomain(recording ? factsNow() : await readFacts(env, TEMPLATES));
    drawDetail();
  }, SOON_MS);

  function drawDetail() {
    const isShown = part === "operators";
    page.split.className = isShown ? "split" : "wide-list";
    page.showsDetail(isShown && chosen);
    detail.hidden = !isShown;
    if (!isShown || !domain || detail.contains(document.activeElement)) return;
    const operator = domain.operators.find((each) => each.name === chosen),
      inPlans = calls.flatMap((plan) =>
        plan.actions
          .filter((action) => action["operator-name"] === chosen)
          .map((action) => ({ label: plan["goal-id"] + " " + action.id, values: action["param-values"] })),
      );
    redraw(detail, [chosen, operator, [...domain.facts], inPlans], () =>
      operator
        ? operatorDetail(operator, inPlans)
        : chosen
          ? none("There is no operator " + chosen)
          : none(
              "Choose an operator",
              "Its precondition and effects are shown here, with what is false now.",
            ),
    );
  }
  function operatorDetail(operator, inPlans) {
    const values = inPlans[0]?.values ?? [],
      usual = operator.parameters.map(({ name }, at) => [name, values[at] ?? ""]);
    if (!bindings.has(chosen)) bindings.set(chosen, new Map(usual));
    return [
      el("div.detail-head", backLink("#/domain/operators", "operators"), el.h2(operator.name)),
      operatorView(domain, operator, bindings.get(chosen), inPlans.slice(0, MOST_CALLS)),
    ];
  }

  function itemsAre(list) {
    items = list.map(PARTS[part]).map(([name, rest = "", note = ""], number) => {
      const line = name + " " + rest + " " + note;
      return { number, name, rest, note, line };
    });
  }
  function draw() {
    const found = items.filter((item) => page.matches(item.line));
    if (byName) found.sort((a, b) => (a.line < b.line ? -1 : a.line > b.line ? 1 : 0));
    const hint = app.recording
      ? "They are in recordings of --trace-level facts."
      : "The executive has not loaded a domain.";
    page.show(found, items.length, "No " + part, hint);
    mark();
  }
  const mark = () => {
    const item = chosen && items.find((each) => each.name === chosen);
    if (item) page.list.mark(String(item.number), true);
  };
  function renew() {
    envs.renew();
    if (app.recording) {
      itemsAre(MODELS[pathOf(part)].make(factsNow()));
      draw();
    } else read();
    readDetails();
  }
  const soon = life.reader(async () => renew(), SOON_MS);
  life.add(
    app.model.onChange((topics) => topics.has("facts") && soon()),
    app.onRenew(renew),
  );
  return {
    go([name = "facts", which = ""]) {
      const before = part;
      part = Object.hasOwn(PARTS, name) ? name : "facts";
      chosen = which;
      redraw(detail);
      drawDetail();
      if (part === before && items.length) {
        readDetails();
        mark();
        return;
      }
      refill(bar, tabs("Parts of the domain", LINKS, "#/domain/" + part));
      items = [];
      page.list.box.scrollTop = 0;
      renew();
    },
    close: life.close,
  };
}
