// CLIPS environments: make and destroy them, load files into them, request features, watch, drop log
// lines, evaluate.
import { get, part, post, put, remove, throttled } from "cx/api.js";
import { badge, button, el, none, pairs, panel, refill } from "cx/dom.js";
import { MAIN_ENV } from "cx/model.js";
import { VirtualList } from "cx/virtual.js";
import { clipsTabs } from "cx/views/clips.js";

export const parts = ["clips/environments"];
export const kinds = [];
const BASE = "cxbridge/environments",
  SOON_MS = 500,
  AGAIN_MS = 3000;
const LEVELS = ["debug", "info", "warn", "error"],
  ITEMS = ["facts", "rules", "all"];
const PROGRAMS = ["env-eval", "env-load"]; // forms that may run a program

export function open(root, app) {
  let infos = [],
    chosen = "",
    problem = "",
    output = "",
    drawn = "";
  const list = new VirtualList({
    label: "Environments",
    key: (item) => item.name,
    sign: (item) => item.facts + " " + item.agenda + " " + item.ended,
    height: "--row-two",
    draw: (item) => [
      el(
        "span.two",
        el("b.main-text", item.name),
        el(
          "span.dim.small.main-text",
          item.facts +
            " facts, " +
            item.agenda +
            " on the agenda, " +
            (item.own ? "made by request" : "the executive's own"),
        ),
      ),
      item.ended ? badge("failed", "!", "ended") : null,
    ],
    select: (item) => {
      location.hash = "#/clips/environments/" + part(item.name);
    },
  });
  const empty = el.div({ hidden: true }),
    detail = el("div.detail");
  const name = el("input#new-env", {
    type: "text",
    "aria-label": "name of a new environment",
    placeholder: "name",
    spellcheck: "false",
    autocomplete: "off",
    autocapitalize: "off",
  });
  const create = el("button.primary", { type: "submit" }, "Create");
  const form = el("form#create-env.grow-form", name, create);
  const layout = el(
    "div.split",
    panel("CLIPS", [], el.div(clipsTabs("environments")), el("div.tools.below", form), empty, list.box),
    detail,
  );
  root.append(layout);

  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const wish = name.value.trim();
    if (!wish) {
      name.focus();
      return;
    }
    act(async () => {
      await post(BASE, { name: wish });
      name.value = "";
      location.hash = "#/clips/environments/" + part(wish);
    }, wish + " is created");
  });

  const read = throttled(
    async () => {
      infos = await get(BASE);
      problem = "";
      draw();
    },
    SOON_MS,
    (error) => {
      problem = error.message;
      infos = [];
      draw();
    },
  );
  async function act(call, done) {
    const went = await app.attempt(call, done);
    read();
    app.readStatus();
    return went;
  }

  function draw() {
    list.box.hidden = !infos.length;
    empty.hidden = infos.length > 0;
    if (!infos.length)
      empty.replaceChildren(
        app.recording
          ? none("Not in a recording", "Choose an environment above the facts.")
          : none(problem || "No environments", problem ? "" : "There is no executive."),
      );
    app.gate(create);
    list.set(infos);
    drawDetail();
  }
  const field = (label, input) => el.label(el.span(label), input);
  const text = (placeholder, more = {}) =>
    el.input({
      type: "text",
      placeholder,
      spellcheck: "false",
      autocomplete: "off",
      autocapitalize: "off",
      ...more,
    });
  const select = (values, now) =>
    el.select(values.map((value) => el.option({ selected: value === now }, value)));
  /** A form with its title, fields and button. */
  function block(title, id, fields, label, call, more = []) {
    const made = el(
      "form.part",
      { id },
      el.h3(title),
      el(
        "div.fields",
        fields,
        app.gate(
          el.button(
            PROGRAMS.includes(id) ? { type: "submit", "data-needs": "programs" } : { type: "submit" },
            label,
          ),
        ),
        more,
      ),
    );
    made.addEventListener("submit", (event) => {
      event.preventDefault();
      call();
    });
    return made;
  }

  function drawDetail() {
    const info = infos.find((each) => each.name === chosen);
    layout.classList.toggle("has-detail", Boolean(chosen));
    const sign = JSON.stringify([chosen, info && { ...info, facts: 0, agenda: 0 }, app.whyNoPrograms]);
    if (sign === drawn) return;
    drawn = sign;
    if (!info) {
      refill(
        detail,
        none(
          chosen && infos.length ? "There is no environment " + chosen : "Choose an environment",
          "Files can be loaded into it, features requested, expressions evaluated.",
        ),
      );
      return;
    }
    const path = BASE + "/" + part(info.name),
      features = info.features || [],
      watch = info.watch || [];
    const file = text("/path/to/rules.clp"),
      how = select(["load", "batch"]),
      feature = text("navgraph"),
      item = select(ITEMS),
      names = text("all names"),
      level = select(LEVELS, info.log_level);
    const expression = text("(+ 1 2)"),
      answer = el("pre#env-answer", { "aria-live": "polite", hidden: !output }, output);
    const setWatch = (on) =>
      act(() =>
        put(path + "/watch", { item: item.value, names: names.value.split(/[\s,]+/).filter(Boolean), on }),
      );
    refill(
      detail,
      el(
        "div.detail-head",
        el("a.back", { href: "#/clips/environments", "aria-label": "back to the environments" }, "←"),
        el.h2(info.name),
        info.ended ? badge("failed", "!", "its rules have ended") : null,
        !info.own
          ? null
          : app.gate(
              button(
                "Destroy",
                () => {
                  if (confirm("Destroy the environment " + info.name + " with all its facts?"))
                    act(async () => {
                      await remove(path);
                      location.hash = "#/clips/environments";
                    }, info.name + " is destroyed");
                },
                { class: "danger", id: "destroy-env" },
              ),
            ),
      ),
      pairs([
        ["features", features.join(", ") || "none"],
        ["watched", watch.join(", ") || "nothing"],
        ["log", info.log_level + " and above"],
        [
          "look at",
          [
            el.a({ href: "#/clips/facts", on: { click: look } }, "facts"),
            " ",
            el.a({ href: "#/clips/rules", on: { click: look } }, "rules"),
            " ",
            el.a({ href: "#/clips/agenda", on: { click: look } }, "agenda"),
          ],
        ],
      ]),
      app.whyNot
        ? el("p.note", "Nothing can be changed: " + app.whyNot + ".")
        : app.whyNoPrograms
          ? el("p.note", "Nothing can be evaluated or loaded: " + app.whyNoPrograms + ".")
          : null,
      block("Evaluate", "env-eval", [field("expression", expression)], "Evaluate", () =>
        act(async () => {
          const value = await post(path + "/eval", { expression: expression.value });
          say([...(value.output || []), value.text].filter((each) => each !== "").join("\n") || "(nothing)");
        }),
      ),
      answer,
      block(
        "Load a file of the daemon's machine",
        "env-load",
        [field("file", file), field("how", how)],
        "Load",
        () =>
          act(async () => {
            const { diagnostics } = await post(path + "/load", {
              file: file.value.trim(),
              batch: how.value === "batch",
            });
            say(diagnostics.length ? diagnostics.join("\n") : file.value.trim() + " is loaded");
          }),
      ),
      block("Request a feature", "env-feature", [field("feature", feature)], "Request", () =>
        act(() => post(path + "/features", { feature: feature.value.trim() })),
      ),
      block(
        "Watch, for recordings",
        "env-watch",
        [field("what", item), field("names", names)],
        "Watch",
        () => setWatch(true),
        app.gate(button("Watch no more", () => setWatch(false), { id: "env-unwatch" })),
      ),
      block("Log", "env-log", [field("lines from", level)], "Set", () =>
        act(() => put(path + "/log", { level: level.value })),
      ),
    );
    function say(lines) {
      output = lines;
      const place = document.getElementById("env-answer");
      place.hidden = false;
      place.textContent = lines;
    }
    function look() {
      app.chosenEnv = info.name === MAIN_ENV ? "" : info.name;
    }
  }

  const renewed = app.onRenew(read),
    unsubscribe = app.onChange(draw);
  const again = setInterval(() => {
    if (!app.recording && !document.hidden && app.connection === "open") read();
  }, AGAIN_MS);
  if (!app.recording) read();
  draw();
  return {
    go([, which = ""]) {
      if (which !== chosen) output = "";
      chosen = which;
      list.mark(which, true);
      drawDetail();
    },
    close() {
      renewed();
      unsubscribe();
      clearInterval(again);
      read.stop();
      list.gone();
    },
  };
}
