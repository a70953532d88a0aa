// The PDDL domain: facts, objects, predicates, operators.
import { get, part as segment, throttled } from "cx/api.js";
import { MODELS } from "cx/clips/text.js";
import { checkbox, el, none, panel, refill, search, tabs } from "cx/dom.js";
import { operatorView } from "cx/domain/operator_view.js";
import { readDomain, TEMPLATES } from "cx/domain/operators.js";
import { envSelect, readOf } from "cx/env.js";
import { VirtualList } from "cx/virtual.js";

export const tab = { title: "Domain", order: 40 };
export const kinds = ["fact"];
const SOON_MS = 1500;
const typed = (names, types) =>
  names.map((name, at) => "?" + name + (types[at] ? " - " + types[at] : "")).join(" ");
const PARTS = {
  facts: {
    title: "Facts",
    path: "domain-facts",
    text: (each) => [each.name, each["param-values"].join(" ")],
  },
  objects: { title: "Objects", path: "domain-objects", text: (each) => [each.name, each.type] },
  predicates: {
    title: "Predicates",
    path: "domain-predicates",
    text: (each) => [each.name, typed(each["param-names"], each["param-types"]), each.sensed ? "sensed" : ""],
  },
  operators: {
    title: "Operators",
    path: "domain-operators",
    text: (each) => [
      each.name,
      each.parameters.map((one) => "?" + one.name + " - " + one.type).join(" "),
      each["wait-sensed"] ? "waits for sensing" : "",
    ],
  },
};

export function open(root, app) {
  let part = "facts",
    items = [],
    wanted = "",
    problem = "",
    byName = true,
    chosen = "",
    domain = null,
    calls = [],
    drawnDetail = "";
  const bindings = new Map(); // operator -> Map parameter -> argument
  const list = new VirtualList({
    label: "Domain",
    key: (item) => String(item.number),
    sign: (item) => item.line,
    draw: (item) => [
      el("code.main-text", el.b(item.name), item.rest ? " " + item.rest : ""),
      item.note ? el("span.dim.small", item.note) : null,
    ],
    select: (item) => {
      if (part === "operators") location.hash = "#/domain/operators/" + segment(item.name);
    },
  });
  const detail = el("div#operator.detail", { hidden: true });
  const bar = el.div();
  const empty = el.div({ hidden: true });
  const counter = el("span.dim.count");
  const envs = envSelect(app, () => {
    items = [];
    draw();
    renew();
  });
  const layout = el(
    "div.wide-list",
    panel(
      "Domain",
      [
        envs,
        counter,
        search("Search the domain", (text) => {
          wanted = text;
          draw();
        }),
        checkbox("by name", true, (on) => {
          byName = on;
          draw();
        }),
      ],
      bar,
      empty,
      list.box,
    ),
    detail,
  );
  root.append(layout);

  const read = throttled(
    async () => {
      const asked = part,
        { env } = app,
        answer = await readOf(env, PARTS[asked].path);
      if (asked !== part || env !== app.env) return;
      problem = "";
      take(answer.map(PARTS[asked].text));
    },
    SOON_MS,
    (error) => {
      problem = error.message;
      take([]);
    },
  );

  /** The facts that operators are made of. */
  const readDetails = throttled(
    async () => {
      if (part !== "operators") return;
      if (app.recording) {
        const facts = [...app.model.factsOf(app.env).values()];
        domain = readDomain(facts.map((fact) => fact.text));
        calls = MODELS.plans.make(facts.filter((fact) => MODELS.plans.templates.includes(fact.template)));
      } else {
        const { env } = app,
          lists = await Promise.all(
            TEMPLATES.map((template) =>
              get("clips/" + segment(env) + "/facts?formatted=true&template=" + template),
            ),
          );
        calls = await readOf(env, "plans");
        domain = readDomain(lists.flat().map((fact) => fact.formatted));
      }
      drawDetail();
    },
    SOON_MS,
    (error) => {
      problem = error.message;
    },
  );
  function drawDetail() {
    const isShown = part === "operators";
    layout.className = isShown ? "split" + (chosen ? " has-detail" : "") : "wide-list";
    detail.hidden = !isShown;
    if (!isShown || !domain) return;
    const operator = domain.operators.find((each) => each.name === chosen);
    const inPlans = calls.flatMap((plan) =>
      plan.actions
        .filter((action) => action["operator-name"] === chosen)
        .map((action) => ({ label: plan["goal-id"] + " " + action.id, values: action["param-values"] })),
    );
    const sign = JSON.stringify([chosen, operator, [...domain.facts], inPlans]);
    if (sign === drawnDetail || detail.contains(document.activeElement)) return;
    drawnDetail = sign;
    if (!operator) {
      refill(
        detail,
        chosen
          ? none("There is no operator " + chosen)
          : none(
              "Choose an operator",
              "Its precondition and effects are shown here, with what is false now.",
            ),
      );
      return;
    }
    if (!bindings.has(chosen))
      bindings.set(
        chosen,
        new Map(operator.parameters.map((each, at) => [each.name, inPlans[0] ? inPlans[0].values[at] : ""])),
      );
    refill(
      detail,
      el(
        "div.detail-head",
        el("a.back", { href: "#/domain/operators", "aria-label": "back to the operators" }, "←"),
        el.h2(operator.name),
      ),
      operatorView(domain, operator, bindings.get(chosen), inPlans.slice(0, 6)),
    );
  }

  function take(rows) {
    items = rows.map(([name, rest = "", note = ""], number) => ({
      number,
      name,
      rest,
      note,
      line: name + " " + rest + " " + note,
    }));
    draw();
  }
  /** Of a recording: made of its facts. */
  function recorded() {
    const { templates, make } = MODELS[PARTS[part].path];
    take(
      make([...app.model.factsOf(app.env).values()].filter((fact) => templates.includes(fact.template))).map(
        PARTS[part].text,
      ),
    );
  }
  function draw() {
    const found = items.filter((item) => !wanted || item.line.toLowerCase().includes(wanted));
    if (byName) found.sort((a, b) => (a.line < b.line ? -1 : a.line > b.line ? 1 : 0));
    counter.textContent =
      found.length === items.length ? String(items.length) : found.length + " of " + items.length;
    list.box.hidden = !found.length;
    empty.hidden = found.length > 0;
    if (!found.length) {
      empty.replaceChildren(
        items.length
          ? none("Nothing matches")
          : none(
              problem || "No " + PARTS[part].title.toLowerCase(),
              app.recording
                ? "They are in recordings of --trace-level facts."
                : problem
                  ? ""
                  : "The executive has not loaded a domain.",
            ),
      );
    }
    list.set(found);
    mark();
  }
  const mark = () => {
    const item = chosen && items.find((each) => each.name === chosen);
    if (item) list.mark(String(item.number), true);
  };
  function renew() {
    envs.renew();
    if (app.recording) recorded();
    else read();
    readDetails();
  }
  const dirty = throttled(async () => renew(), SOON_MS);
  const stop = app.model.onChange((topics) => {
    if (topics.has("facts")) dirty();
  });
  const renewed = app.onRenew(renew);
  return {
    go([name = "facts", which = ""]) {
      const before = part;
      part = name in PARTS ? name : "facts";
      chosen = which;
      drawnDetail = "";
      drawDetail();
      if (part === before && items.length) {
        readDetails();
        mark();
        return;
      }
      bar.replaceChildren(
        tabs(
          "Parts of the domain",
          Object.entries(PARTS).map(([key, one]) => ["#/domain/" + key, one.title]),
          "#/domain/" + part,
        ),
      );
      items = [];
      list.box.scrollTop = 0;
      renew();
    },
    close() {
      stop();
      renewed();
      read.stop();
      readDetails.stop();
      dirty.stop();
      list.gone();
    },
  };
}
