// CLIPS: facts, rules and agenda of an environment; why a rule has not fired; asserting, changing and
// retracting.
import { factsPath, get, part, post } from "cx/api.js";
import { templateOwners } from "cx/clips/source.js";
import { factForm, ruleDetail } from "cx/clips/details.js";
import {
  agendaItems,
  factItems,
  factsOverview,
  ruleItems,
  rulesOfRecording,
  rulesOverview,
} from "cx/clips/lists.js";
import { capital, button, checkbox, dim, el, form, none, refill, submit, tabs, textInput } from "cx/dom.js";
import { envSelect } from "cx/env.js";
import { ListPanel } from "cx/scaffold.js";
import { whyBox } from "cx/why.js";

export const tab = { title: "CLIPS", order: 60 };
export const kinds = ["fact", "rule"];
const SOON_MS = 1000,
  NARROW = 760; // pixels: there details take the place of the list
const NAMES = ["facts", "rules", "agenda", "environments"],
  TABS = NAMES.map((key) => ["#/clips/" + key, capital(key)]);
export const clipsTabs = (current) => tabs("Parts of CLIPS", TABS, "#/clips/" + current);

/** Texts of empty lists: of a daemon, and of a recording. */
const NOTHING = {
  facts: ["No facts", "", "They are in recordings of --trace-level facts."],
  rules: ["No rules", "", ""],
  agenda: ["The agenda is empty", "No rule waits to fire: each loop ends so.", "A recording has none."],
};

export function open(root, app) {
  let tab = "",
    rules = [],
    agenda = [],
    chosen = "",
    owners = { core: new Set(), own: new Set(), of: "" },
    onlyFired = false,
    awaited = null, // the index of a chosen fact that has not come yet
    shownRule = null;
  const bar = el.div(),
    tools = el("div.tools.below"),
    detail = el("div.detail");
  const envs = envSelect(app, () => {
    chosen = "";
    rules = [];
    agenda = [];
    drawDetail(null);
    renew();
    draw();
  });
  const page = new ListPanel(
    {
      title: "CLIPS",
      find: "Search CLIPS",
      before: envs,
      above: [bar, tools],
      detail,
      row: {
        key: (item) => item.key,
        sign: (item) => item.sign,
        draw: (item) => item.draw(),
        select: (item, how) => {
          chosen = item.key;
          awaited = null;
          if (how !== "key" || root.clientWidth > NARROW) drawDetail(item);
        },
      },
    },
    draw,
  );
  const { list, life } = page,
    matches = (text) => page.matches(text);
  root.append(page.split);

  const facts = () => app.model.factsOf(app.env);
  const reading = (read) => page.reader(read, SOON_MS);
  const readers = {
    facts: reading(async () => {
      const of = app.env;
      await app.live.update(
        () => get(factsPath(of)),
        (found) => app.live.factsAre(of, found),
      );
    }),
    rules: reading(async () => {
      rules = await get("cxbridge/rules?env=" + part(app.env));
      if (!chosen || tab !== "rules") return;
      list.mark(chosen, true);
      if (!detail.querySelector("#rule-source")) drawDetail({ rule: { name: chosen.slice(2) } });
    }),
    agenda: reading(async () => {
      agenda = await get("cxbridge/agenda?env=" + part(app.env));
    }),
  };
  const renew = () => app.recording || readers[tab]();
  /** Which deftemplates are the CX core's: facts of the agent come before those. */
  const readOwners = life.reader(async () => {
    const { env } = app;
    owners = { ...(await templateOwners(app, env)), of: env };
    draw();
  }, SOON_MS);

  /** The daemon counts the firings of a live run: all pages show the same. */
  const firings = (rule) =>
    (app.recording ? app.model.firings.get(app.env + " " + rule.name) : rule.firings) || 0;
  const allRules = () => (app.recording ? rulesOfRecording(app) : rules);
  const items = {
    facts() {
      if (owners.of !== app.env) readOwners();
      return factItems(facts().values(), owners, matches);
    },
    rules: () => ruleItems(allRules(), firings, matches, onlyFired),
    agenda: () => agendaItems(agenda, matches),
  };
  function draw() {
    const found = items[tab](),
      all = { facts: facts().size, rules: rules.length || found.length, agenda: agenda.length }[tab],
      [text, live, recorded] = NOTHING[tab];
    page.show(found, all, text, app.recording ? recorded : live);
    updateRule();
    envs.renew();
    if (!chosen && found.length && detail.querySelector(".empty")) drawOverview(); // which says that the list is empty
    overview();
  }

  const assertion = textInput({
    id: "new-fact",
    "aria-label": "fact to assert",
    placeholder: "(my-fact (slot value))",
  });
  async function assert() {
    const fact = assertion.value.trim();
    if (!fact) return assertion.focus();
    const done = await app.attempt(async () => {
      const answer = await post("cxbridge/facts", { fact, env: app.env });
      app.toast("Asserted f-" + answer.index);
    });
    if (!done) return null;
    assertion.value = "";
    return readers.facts();
  }
  const filterRules = (on) => {
    onlyFired = on;
    draw();
  };
  const toolsOf = {
    facts: () => form("#assert.grow-form", assert, assertion, app.gate(submit("Assert"))),
    rules: () => checkbox("only those that fired or wait", onlyFired, filterRules),
    agenda: () => button("Read again", readers.agenda),
  };

  /** The chosen fact has another index now, or is gone; the form of a new index follows with its fact. */
  function changed(before, index) {
    readers.facts();
    if (chosen !== "f-" + before) return; // another one was chosen meanwhile
    awaited = index;
    chosen = index === null ? "" : "f-" + index;
    list.mark(chosen);
    if (index === null) drawDetail(null);
    else follow();
  }
  function follow() {
    const fact = awaited !== null && facts().get(awaited);
    if (!fact) return;
    awaited = null;
    drawDetail({ fact });
  }

  const overview = life.reader(async () => {
    if (!chosen && !detail.contains(document.activeElement)) drawOverview();
  }, SOON_MS);
  function chooseTemplate(template) {
    page.find.value = "(" + template;
    page.wanted = page.find.value.toLowerCase();
    draw();
  }
  const drawOverview = () =>
    refill(
      detail,
      tab === "facts"
        ? factsOverview([...facts().values()], owners, chooseTemplate, app.mayChange)
        : rulesOverview(allRules(), firings),
    );
  function updateRule() {
    const known = shownRule && allRules().find((each) => each.name === shownRule.name);
    if (known) shownRule.update(known, firings(known));
  }
  function leave() {
    chosen = "";
    list.mark("");
    drawDetail(null);
  }
  function drawDetail(item) {
    shownRule = null;
    page.showsDetail(item);
    const back = button("←", leave, { class: "back quiet", "aria-label": "back" });
    if (!item) drawOverview();
    else if (item.fact) drawFact(item.fact, back);
    else drawRule(item.rule, back);
  }
  function drawFact(fact, back) {
    const about = { button: { id: "why-fact" }, box: { id: "why-text" } },
      name = "f-" + fact.index,
      why = whyBox(app, "fact", name, app.env, about);
    refill(
      detail,
      el("div.detail-head", back, el.h2(name), dim(fact.template), why.button),
      why.box,
      app.recording ? el.pre(fact.text) : factForm(app, app.env, fact, (index) => changed(fact.index, index)),
    );
  }
  function drawRule(rule, back) {
    const found = rules.find((each) => each.name === rule.name),
      known = found || rule;
    if (!found && tab === "rules" && rules.length && !app.recording)
      return refill(detail, none("There is no rule " + rule.name));
    shownRule = { name: rule.name, ...ruleDetail(app, known, firings(known), back) };
    return refill(detail, shownRule.nodes);
  }

  const slow = life.reader(async () => tab === "facts" || renew(), SOON_MS);
  const soon = life.paced(
    () => {
      if (tab !== "facts") return;
      draw();
      follow();
    },
    () => facts().size,
  );
  life.add(
    app.model.onChange((topics) => {
      if (topics.has("facts")) soon();
      if (!topics.has("rules") || tab === "facts") return;
      if (tab === "rules") draw();
      slow();
    }),
    app.onRenew(renew),
  );
  return {
    go([name = "facts", which = ""]) {
      if (name !== tab) {
        tab = Object.hasOwn(readers, name) ? name : "facts";
        chosen = page.problem = "";
        list.box.scrollTop = 0;
        refill(bar, clipsTabs(tab));
        refill(tools, (!app.recording || tab === "rules") && toolsOf[tab]());
        drawDetail(null);
        if (!app.stream.isWaiting || app.connection === "lost") renew();
      }
      draw();
      if (!which || tab === "agenda") return;
      chosen = tab === "rules" ? "r-" + which : which;
      list.mark(chosen, true);
      if (tab === "rules") drawDetail({ rule: { name: which } });
      else awaited = Number(which.slice(2));
      follow();
    },
    close: life.close,
  };
}
