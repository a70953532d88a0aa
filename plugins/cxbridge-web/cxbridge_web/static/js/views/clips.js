// CLIPS: facts and rules of an environment; why a fact is there, why a rule has not fired.
import { escapePart, factsPath, get } from "cx/api.js";
import { factItems, ruleItems, rulesOfRecording } from "cx/clips/lists.js";
import { findConstruct, templateOwners } from "cx/clips/source.js";
import { button, capital, dim, el, none, note, redraw, refill, tabs } from "cx/dom.js";
import { envSelect } from "cx/env.js";
import { ListPanel } from "cx/scaffold.js";
import { whyBox } from "cx/why.js";

export const tab = { title: "CLIPS", order: 60 };
export const kinds = ["fact", "rule"];
const SOON_MS = 1000, // the shortest time between two requests of a kind
  NARROW = 760; // pixels; on a narrower page the details replace the list
const TAB_NAMES = ["facts", "rules"],
  TABS = TAB_NAMES.map((key) => ["#/clips/" + key, capital(key)]),
  HINTS = {
    facts: "They are in recordings of --trace-level facts.",
    rules: "A recording without attached files shows the rules that have fired.",
  };

export function open(root, app) {
  let shownTab = "", // of TAB_NAMES
    rules = [],
    chosen = "", // f-INDEX or r-NAME
    owners = { core: new Set(), own: new Set(), env: "" }; // see templateOwners()
  const bar = el.div(),
    detail = el("div.detail");
  const envs = envSelect(app, () => {
    rules = [];
    choose("");
    renew();
    draw();
  });
  const page = new ListPanel(
    {
      title: "CLIPS",
      find: "Search CLIPS",
      before: envs,
      above: bar,
      detail,
      row: {
        key: (item) => item.key,
        sign: (item) => item.sign,
        draw: (item) => item.draw(),
        select: ({ key }, how) => {
          if (how !== "key" || root.clientWidth > NARROW) choose(key);
        },
      },
    },
    draw,
  );
  const { list, life } = page,
    matches = (text) => page.matches(text);
  root.append(page.split);

  const facts = () => app.model.factsOf(app.env);
  const readers = {
    facts: page.reader(async () => {
      const { env } = app;
      await app.live.update(
        () => get(factsPath(env)),
        (models) => app.live.factsAre(env, models),
      );
    }, SOON_MS),
    rules: page.reader(async () => {
      rules = await get("cxbridge/rules?env=" + escapePart(app.env));
    }, SOON_MS),
  };
  const renew = () => app.recording || readers[shownTab]();
  /** Read the owners of the deftemplates: facts of the agent come before facts of the CX core. */
  const readOwners = life.reader(async () => {
    const { env } = app;
    owners = { ...(await templateOwners(app, env)), env };
    draw();
  }, SOON_MS);

  /** How often a rule fired; the daemon counts for live runs, so that all pages show the same number. */
  const firings = (rule) =>
    (app.recording ? app.model.firings.get(app.env + " " + rule.name) : rule.firings) || 0;
  const allRules = () => (app.recording ? rulesOfRecording(app) : rules);
  const itemsByTab = {
    facts() {
      if (owners.env !== app.env) readOwners();
      return factItems(facts().values(), owners, matches);
    },
    rules: () => ruleItems(allRules(), firings, matches),
  };
  function draw() {
    const fitting = itemsByTab[shownTab](),
      total = shownTab === "facts" ? facts().size : allRules().length;
    page.show(fitting, total, "No " + shownTab, app.recording ? HINTS[shownTab] : "");
    envs.renew();
    drawDetail();
  }

  function choose(key) {
    chosen = key;
    list.mark(key, true);
    drawDetail();
  }
  function drawDetail() {
    const name = chosen.slice(2), // behind f- or r-
      fact = shownTab === "facts" && facts().get(Number(name)),
      rule = shownTab === "rules" && allRules().find((listed) => listed.name === name);
    page.showDetailOf(chosen);
    if (!chosen) redraw(detail, shownTab, () => none("Choose a " + shownTab.slice(0, -1)));
    else if (fact) redraw(detail, fact, () => factDetail(fact));
    else if (rule) redraw(detail, [app.env, rule.name], () => ruleDetail(rule));
    else
      redraw(detail, chosen, () => [
        head(chosen),
        note("There is no such " + shownTab.slice(0, -1) + " now."),
      ]);
    if (rule) drawPlace(rule);
  }
  function head(title, ...more) {
    const backButton = button("←", () => choose(""), { class: "back quiet", "aria-label": "back" });
    return el("div.detail-head", backButton, el.h2(title), more);
  }
  const whyOf = (kind, name) =>
    whyBox(app, kind, name, app.env, { button: { id: "why-" + kind }, box: { id: "why-text" } });
  function factDetail({ index, template, text }) {
    const why = whyOf("fact", "f-" + index);
    return [head("f-" + index, dim(template), why.button), why.box, el.pre(text)];
  }
  function ruleDetail({ name }) {
    const why = whyOf("rule", name),
      source = el("div#rule-source"),
      showSource = (construct) =>
        refill(
          source,
          construct
            ? [
                el.h3("Source ", dim(construct.file + ":" + construct.line)),
                el("pre.source", { tabindex: "0", "aria-label": "source of " + name }, construct.text),
              ]
            : note("No file that can be read has this rule."),
        );
    // no error here: if the daemon does not answer, the list of rules shows the error of its own request
    findConstruct(app, app.env, "defrule", name).then(showSource, () => {});
    return [head(name, why.button), note(el("span#rule-place")), why.box, source];
  }
  /** Show the module, owner, salience and firings of a rule; the number of firings changes all the time. */
  function drawPlace(rule) {
    const fired = firings(rule),
      texts = [rule.module, rule.core && "CX core", rule.salience && "salience " + rule.salience];
    document.getElementById("rule-place").textContent = [...texts, "fired " + fired + "×"]
      .filter(Boolean)
      .join(" · ");
  }

  const renewSoon = life.reader(async () => renew(), SOON_MS);
  const drawSoon = life.paced(draw, () => facts().size);
  life.add(
    app.model.onChange((topics) => {
      if (topics.has(shownTab)) drawSoon();
      if (topics.has("rules") && shownTab === "rules") renewSoon();
    }),
    app.onRenew(renew),
  );
  return {
    go([name = "facts", itemName = ""]) {
      if (name !== shownTab) {
        shownTab = TAB_NAMES.includes(name) ? name : "facts";
        chosen = page.problem = "";
        list.box.scrollTop = 0;
        refill(bar, tabs("Parts of CLIPS", TABS, "#/clips/" + shownTab));
        // else the event hello leads to a renewal
        if (!app.stream.isWaiting || app.connection === "lost") renew();
      }
      draw();
      if (itemName) choose(shownTab === "rules" ? "r-" + itemName : itemName);
    },
    close: life.close,
  };
}
