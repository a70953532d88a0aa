// CLIPS: facts, rules and agenda of an environment; why a rule has not fired; asserting, changing and
// retracting.
import { get, part, post, throttled } from "cx/api.js";
import { button, checkbox, el, none, paced, panel, refill, search, tabs } from "cx/dom.js";
import { envSelect } from "cx/env.js";
import { templateOwners } from "cx/clips/constructs.js";
import { factForm } from "cx/clips/fact_form.js";
import { agendaItems, factItems, ruleItems, rulesOfRecording } from "cx/clips/items.js";
import { factsOverview, rulesOverview } from "cx/clips/overview.js";
import { ruleDetail } from "cx/clips/rule.js";
import { VirtualList } from "cx/virtual.js";
import { whyBox } from "cx/why.js";

export const tab = { title: "CLIPS", order: 60 };
export const kinds = ["fact", "rule"];
const SOON_MS = 1000,
  FACTS_MS = 1000;
export const TABS = [
  ["facts", "Facts"],
  ["rules", "Rules"],
  ["agenda", "Agenda"],
  ["environments", "Environments"],
];
export const clipsTabs = (current) =>
  tabs(
    "Parts of CLIPS",
    TABS.map(([key, title]) => ["#/clips/" + key, title]),
    "#/clips/" + current,
  );

export function open(root, app) {
  let tab = "facts",
    wanted = "",
    problem = "",
    rules = [],
    agenda = [],
    chosen = "",
    core = new Set(),
    own = new Set(),
    coreOf = "",
    onlyFired = false,
    typed = "",
    awaited = null,
    shownRule = null; // what is shown of a rule, until something else is
  const bar = el.div(),
    tools = el("div.tools.below"),
    empty = el.div({ hidden: true });
  const counter = el("span.dim.count");
  const detail = el("div.detail");
  const envs = envSelect(app, () => {
    chosen = "";
    rules = [];
    agenda = [];
    drawDetail(null);
    renew();
    draw();
  });
  const inEnv = () => "env=" + part(app.env);
  const list = new VirtualList({
    label: "CLIPS",
    key: (item) => item.key,
    sign: (item) => item.sign,
    draw: (item) => item.draw(),
    select: (item, how) => {
      chosen = item.key;
      awaited = null;
      if (how !== "key" || root.clientWidth > 760) drawDetail(item);
    },
  });
  const find = search("Search CLIPS", (text) => {
    wanted = text;
    draw();
  });
  const layout = el("div.split", panel("CLIPS", [envs, counter, find], bar, tools, empty, list.box), detail);
  root.append(layout);

  const fail = (error) => {
    problem = error.message;
    draw();
  };
  const readFacts = throttled(
    async () => {
      const of = app.env;
      await app.live.update(
        () => get("clips/" + part(of) + "/facts?formatted=true"),
        (facts) => {
          problem = "";
          app.live.factsAre(of, facts);
        },
      );
    },
    FACTS_MS,
    fail,
  );
  const readRules = throttled(
    async () => {
      rules = await get("cxbridge/rules?" + inEnv());
      problem = "";
      draw();
      if (chosen && tab === "rules") list.mark(chosen, true);
      if (chosen && tab === "rules" && !detail.querySelector("#rule-source"))
        drawDetail({ rule: { name: chosen.slice(2) } });
    },
    SOON_MS,
    fail,
  );
  const readAgenda = throttled(
    async () => {
      agenda = await get("cxbridge/agenda?" + inEnv());
      problem = "";
      draw();
    },
    SOON_MS,
    fail,
  );
  function renew() {
    if (app.recording) return;
    ({ facts: readFacts, rules: readRules, agenda: readAgenda })[tab]();
  }

  /** Live, the daemon counts: every page that is opened shows the same. */
  const firings = (rule) =>
    (app.recording ? app.model.firings.get(app.env + " " + rule.name) : rule.firings) || 0;
  /** Which deftemplates are the CX core's: facts of the agent come before those. */
  const readCore = throttled(async () => {
    const { env } = app;
    ({ core, own } = await templateOwners(app, env));
    coreOf = env;
    draw();
  }, SOON_MS);
  const allRules = () => (app.recording ? rulesOfRecording(app) : rules);
  function itemsNow() {
    if (tab === "agenda") return agendaItems(agenda, wanted);
    if (tab === "rules") return ruleItems(allRules(), firings, { wanted, onlyFired });
    if (coreOf !== app.env) readCore();
    return factItems(app.model.factsOf(app.env).values(), { core, own }, wanted);
  }
  function draw() {
    const items = itemsNow();
    const all = {
      facts: app.model.factsOf(app.env).size,
      rules: rules.length || items.length,
      agenda: agenda.length,
    }[tab];
    counter.textContent = items.length === all ? String(all) : items.length + " of " + all;
    list.box.hidden = !items.length;
    empty.hidden = items.length > 0;
    if (!items.length) {
      const [text, hint] = {
        facts: ["No facts", app.recording ? "They are in recordings of --trace-level facts." : ""],
        rules: ["No rules", ""],
        agenda: [
          "The agenda is empty",
          app.recording ? "A recording has none." : "No rule waits to fire: each loop ends so.",
        ],
      }[tab];
      empty.replaceChildren(all ? none("Nothing matches") : none(problem || text, problem ? "" : hint));
    }
    list.set(items);
    updateRule();
    envs.renew();
    if (!chosen && items.length && detail.querySelector(".empty")) drawOverview(); // it says that there is nothing
    overview();
  }

  function drawTools() {
    bar.replaceChildren(clipsTabs(tab));
    tools.replaceChildren();
    if (tab === "facts" && !app.recording) {
      const input = el("input#new-fact", {
        type: "text",
        "aria-label": "fact to assert",
        placeholder: "(my-fact (slot value))",
        spellcheck: "false",
        autocomplete: "off",
        autocapitalize: "off",
        value: typed,
      });
      input.addEventListener("input", () => {
        typed = input.value;
      });
      const form = el(
        "form#assert.grow-form",
        input,
        app.gate(el("button.primary", { type: "submit" }, "Assert")),
      );
      form.addEventListener("submit", async (event) => {
        event.preventDefault();
        if (!input.value.trim()) {
          input.focus();
          return;
        }
        const done = await app.attempt(async () => {
          const answer = await post("cxbridge/facts", { fact: input.value.trim(), env: app.env });
          app.toast("Asserted f-" + answer.index);
        });
        if (done) {
          input.value = typed = "";
          readFacts();
        }
      });
      tools.append(form);
    } else if (tab === "rules")
      tools.append(
        checkbox("only those that fired or wait", onlyFired, (on) => {
          onlyFired = on;
          draw();
        }),
      );
    else if (tab === "agenda" && !app.recording) tools.append(button("Read again", readAgenda));
  }

  /** The chosen fact has another index now, or is gone; its form follows when it is there. */
  function changed(before, index) {
    readFacts();
    if (chosen !== "f-" + before) return; // another one was chosen meanwhile
    awaited = index;
    chosen = index === null ? "" : "f-" + index;
    list.mark(chosen);
    if (index === null) drawDetail(null);
    else follow();
  }
  function follow() {
    const fact = awaited !== null && app.model.factsOf(app.env).get(awaited);
    if (!fact) return;
    awaited = null;
    drawDetail({ fact });
  }

  const overview = throttled(async () => {
    if (!chosen && !detail.contains(document.activeElement)) drawOverview();
  }, FACTS_MS);
  function chooseTemplate(template) {
    find.value = "(" + template;
    wanted = find.value.toLowerCase();
    draw();
  }
  function drawOverview() {
    if (tab === "facts")
      refill(
        detail,
        factsOverview([...app.model.factsOf(app.env).values()], { core, own }, chooseTemplate, app.mayChange),
      );
    else refill(detail, rulesOverview(allRules(), firings));
  }
  /** The chosen rule has fired again, or more is known of it. */
  function updateRule() {
    const known = shownRule && allRules().find((each) => each.name === shownRule.name);
    if (known) shownRule.update(known, firings(known));
  }
  function drawDetail(item) {
    shownRule = null;
    layout.classList.toggle("has-detail", Boolean(item));
    if (!item) {
      drawOverview();
      return;
    }
    const back = button(
      "←",
      () => {
        chosen = "";
        list.mark("");
        drawDetail(null);
      },
      { class: "back quiet", "aria-label": "back" },
    );
    if (item.fact) {
      const about = { button: { id: "why-fact" }, box: { id: "why-text" } },
        why = whyBox(app, "fact", "f-" + item.fact.index, app.env, about);
      refill(
        detail,
        el(
          "div.detail-head",
          back,
          el.h2("f-" + item.fact.index),
          el("span.dim", item.fact.template),
          why.button,
        ),
        why.box,
        app.recording
          ? el.pre(item.fact.text)
          : factForm(app, app.env, item.fact, (index) => changed(item.fact.index, index)),
      );
      return;
    }
    const { rule } = item,
      found = rules.find((each) => each.name === rule.name),
      known = found || rule;
    if (!found && tab === "rules" && rules.length && !app.recording) {
      refill(detail, none("There is no rule " + rule.name));
      return;
    }
    shownRule = { name: rule.name, ...ruleDetail(app, known, firings(known), back) };
    refill(detail, ...shownRule.nodes);
  }

  const slow = throttled(async () => {
    if (!app.recording && tab !== "facts") renew();
  }, FACTS_MS);
  const soon = paced(
    () => {
      if (tab === "facts") {
        draw();
        follow();
      }
    },
    () => app.model.factsOf(app.env).size,
  );
  const stop = app.model.onChange((topics) => {
    if (topics.has("facts")) soon();
    if (topics.has("rules") && tab !== "facts") {
      if (tab === "rules") draw();
      slow();
    }
  });
  const renewed = app.onRenew(renew);
  return {
    go([name = "facts", which = ""]) {
      if (name !== tab || !bar.children.length) {
        tab = TABS.some(([key]) => key === name) ? name : "facts";
        chosen = "";
        problem = "";
        list.box.scrollTop = 0;
        drawTools();
        drawDetail(null);
        if (!app.stream.isWaiting || app.connection === "lost") renew();
      }
      draw();
      if (which && tab === "rules") {
        const item = { rule: { name: which } };
        chosen = "r-" + which;
        list.mark(chosen, true);
        drawDetail(item);
      } else if (which && tab === "facts") {
        chosen = which;
        awaited = Number(which.slice(2));
        list.mark(chosen, true);
        follow();
      }
    },
    close() {
      stop();
      soon.stop();
      renewed();
      for (const each of [readFacts, readRules, readAgenda, readCore, overview, slow]) each.stop();
      list.gone();
    },
  };
}
