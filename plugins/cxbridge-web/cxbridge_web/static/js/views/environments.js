// CLIPS environments: make and destroy them, load files into them, request features, watch, drop log lines,
// evaluate.
import { get, part, post, put, remove } from "cx/api.js";
import { backLink, badge, button, el, field, form, none, pairs, redraw, submit, textInput } from "cx/dom.js";
import { MAIN_ENV } from "cx/names.js";
import { goTo, ListPanel } from "cx/scaffold.js";
import { clipsTabs } from "cx/views/clips.js";

export const parts = ["clips/environments"];
export const kinds = [];
const BASE = "cxbridge/environments",
  HERE = "#/clips/environments",
  SOON_MS = 500,
  AGAIN_MS = 3000;
const text = (placeholder) => textInput({ placeholder });
const select = (values, now) =>
  el.select(values.map((value) => el.option({ selected: value === now }, value)));
const itemsOf = ({ item, names }, on) => ({ item, names: names.split(/[\s,]+/).filter(Boolean), on });

/** The forms of an environment: title, id, fields, and what each of its buttons does with the fields' values. */
const FORMS = [
  {
    title: "Evaluate",
    id: "env-eval",
    needs: "programs",
    fields: () => ({ expression: text("(+ 1 2)") }),
    async Evaluate(path, { expression }) {
      const value = await post(path + "/eval", { expression });
      return [...(value.output || []), value.text].filter((each) => each !== "").join("\n") || "(nothing)";
    },
  },
  {
    title: "Load a file of the daemon's machine",
    id: "env-load",
    needs: "programs",
    fields: () => ({ file: text("/path/to/rules.clp"), how: select(["load", "batch"]) }),
    async Load(path, { file, how }) {
      const { diagnostics } = await post(path + "/load", { file, batch: how === "batch" });
      return diagnostics.length ? diagnostics.join("\n") : file + " is loaded";
    },
  },
  {
    title: "Request a feature",
    id: "env-feature",
    fields: () => ({ feature: text("navgraph") }),
    Request: (path, { feature }) => post(path + "/features", { feature }),
  },
  {
    title: "Watch, for recordings",
    id: "env-watch",
    fields: () => ({ item: select(["facts", "rules", "all"]), names: text("all names") }),
    Watch: (path, values) => put(path + "/watch", itemsOf(values, true)),
    "Watch no more": (path, values) => put(path + "/watch", itemsOf(values, false)),
  },
  {
    title: "Log",
    id: "env-log",
    fields: ({ log_level: level }) => ({ "lines from": select(["debug", "info", "warn", "error"], level) }),
    Set: (path, { "lines from": level }) => put(path + "/log", { level }),
  },
];

const envRow = ({ name, facts, agenda, own, ended }) => [
  el(
    "span.two",
    el("b.main-text", name),
    el(
      "span.dim.small.main-text",
      `${facts} facts, ${agenda} on the agenda, ` + (own ? "made by request" : "the executive's own"),
    ),
  ),
  ended ? badge("failed", "!", "ended") : null,
];

export function open(root, app) {
  let infos = [],
    chosen = "",
    output = "";
  const detail = el("div.detail"),
    name = textInput({ id: "new-env", "aria-label": "name of a new environment", placeholder: "name" }),
    create = submit("Create");
  const page = new ListPanel(
    {
      title: "CLIPS",
      find: "Search environments",
      above: [
        el.div(clipsTabs("environments")),
        el("div.tools.below", form("#create-env.grow-form", make, name, create)),
      ],
      detail,
      row: {
        key: (item) => item.name,
        sign: (item) => item.facts + " " + item.agenda + " " + item.ended,
        height: "--row-two",
        draw: envRow,
        select: (item) => goTo(HERE + "/" + part(item.name)),
      },
    },
    draw,
  );
  root.append(page.split);

  function make() {
    const wish = name.value.trim();
    if (!wish) return name.focus();
    return act(async () => {
      await post(BASE, { name: wish });
      name.value = "";
      goTo(HERE + "/" + part(wish));
    }, wish + " is created");
  }
  const { life } = page;
  const read = page.reader(async () => {
    infos = await get(BASE);
  }, SOON_MS);
  async function act(call, done) {
    await app.attempt(call, done);
    read();
    app.readStatus();
  }

  function draw() {
    const items = infos.filter((each) => page.matches(each.name));
    if (app.recording) page.show([], 0, "Not in a recording", "Choose an environment above the facts.");
    else page.show(items, infos.length, "No environments", "There is no executive.");
    app.gate(create);
    drawDetail();
  }
  function block({ title, id, needs, fields: makeFields, ...calls }, path, info) {
    const fields = makeFields(info),
      values = () => Object.entries(fields).map(([label, input]) => [label, input.value.trim()]);
    const run = (call) => () =>
      act(async () => {
        const told = await call(path, Object.fromEntries(values()));
        if (typeof told === "string") say(told);
      });
    const [[label, first], ...rest] = Object.entries(calls),
      buttons = [
        app.gate(submit(label, { class: null, "data-needs": needs })),
        rest.map(([text, call]) => app.gate(button(text, run(call), { id: "env-unwatch" }))),
      ];
    const inputs = Object.entries(fields).map(([about, input]) => field(about, input));
    return form("#" + id + ".part", run(first), el.h3(title), el("div.fields", inputs, buttons));
  }
  function say(lines) {
    output = lines;
    const place = document.getElementById("env-answer");
    place.hidden = false;
    place.textContent = lines;
  }

  function drawDetail() {
    const info = infos.find((each) => each.name === chosen),
      state = [chosen, info && { ...info, facts: 0, agenda: 0 }, app.whyNoPrograms];
    page.showsDetail(chosen);
    redraw(detail, state, () =>
      info
        ? detailOf(info)
        : none(
            chosen && infos.length ? "There is no environment " + chosen : "Choose an environment",
            "Files can be loaded into it, features requested, expressions evaluated.",
          ),
    );
  }
  function detailOf(info) {
    const { features = [], watch = [] } = info,
      path = BASE + "/" + part(info.name),
      [evaluate, ...others] = FORMS.map((each) => block(each, path, info));
    const look = () => {
      app.chosenEnv = info.name === MAIN_ENV ? "" : info.name;
    };
    const places = ["facts", "rules", "agenda"].map((place) => [
      el.a({ href: "#/clips/" + place, on: { click: look } }, place),
      " ",
    ]);
    const destroy = () => {
      if (confirm("Destroy the environment " + info.name + " with all its facts?"))
        act(async () => {
          await remove(path);
          goTo(HERE);
        }, info.name + " is destroyed");
    };
    const refused = app.whyNot
      ? "Nothing can be changed: " + app.whyNot
      : app.whyNoPrograms && "Nothing can be evaluated or loaded: " + app.whyNoPrograms;
    return [
      el(
        "div.detail-head",
        backLink(HERE, "environments"),
        el.h2(info.name),
        info.ended ? badge("failed", "!", "its rules have ended") : null,
        info.own ? app.gate(button("Destroy", destroy, { class: "danger", id: "destroy-env" })) : null,
      ),
      pairs([
        ["features", features.join(", ") || "none"],
        ["watched", watch.join(", ") || "nothing"],
        ["log", info.log_level + " and above"],
        ["look at", places],
      ]),
      refused && el("p.note", refused + "."),
      evaluate,
      el("pre#env-answer", { "aria-live": "polite", hidden: !output }, output),
      others,
    ];
  }

  life.add(app.onRenew(read), app.onChange(draw));
  life.every(AGAIN_MS, () => app.recording || app.connection !== "open" || read());
  if (!app.recording) read();
  draw();
  return {
    go([, which = ""]) {
      if (which !== chosen) output = "";
      chosen = which;
      page.list.mark(which, true);
      drawDetail();
    },
    close: life.close,
  };
}
