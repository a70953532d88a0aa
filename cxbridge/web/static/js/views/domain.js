// The PDDL domain: facts, objects, predicates, operators.
import { throttled } from "../api.js";
import { MODELS } from "../clips_text.js";
import { checkbox, el, none, panel, search, tabs } from "../dom.js";
import { envSelect, readOf } from "../env.js";
import { VirtualList } from "../virtual.js";

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
    byName = true;
  const list = new VirtualList({
    label: "Domain",
    key: (item) => String(item.number),
    sign: (item) => item.line,
    draw: (item) => [
      el("code", { class: "main-text" }, el("b", {}, item.name), item.rest ? " " + item.rest : ""),
      item.note ? el("span", { class: "dim small" }, item.note) : null,
    ],
  });
  const bar = el("div");
  const empty = el("div", { hidden: true });
  const told = el("span", { class: "dim count" });
  const envs = envSelect(app, () => {
    items = [];
    draw();
    renew();
  });
  root.append(
    panel(
      "Domain",
      [
        envs,
        told,
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
  );

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
    told.textContent =
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
  }
  function renew() {
    envs.renew();
    if (app.recording) recorded();
    else read();
  }
  const dirty = throttled(async () => renew(), SOON_MS);
  const stop = app.model.onChange((topics) => {
    if (topics.has("facts")) dirty();
  });
  const renewed = app.onRenew(renew);
  return {
    go([name = "facts"]) {
      part = name in PARTS ? name : "facts";
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
      dirty.stop();
      list.gone();
    },
  };
}
