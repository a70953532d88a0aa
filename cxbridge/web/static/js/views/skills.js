// Skills: what runs, its state graph, to call and to stop.
import { get, part, post, remove, throttled } from "../api.js";
import { button, clockText, durationText, el, none, pairs, panel, refill, search } from "../dom.js";
import { controllerName } from "../controller.js";
import { drawGraph } from "../graph/draw.js";
import { skillBadge } from "../looks.js";
import { EXECUTOR, executorsOf, executorTable } from "../skills/executors.js";
import { skillForm } from "../skills/form.js";
import { mappedSkills, parametersOf, parseCall } from "../skills/parameters.js";
import { VirtualList } from "../virtual.js";

export const tab = { title: "Skills", order: 30 };
export const moment = "past";
export const kinds = ["interface"];
const SOON_MS = 500,
  SLOW_MS = 1000;
const STATUS = "SkillerInterface::",
  DEBUG = "SkillerDebugInterface::",
  USUAL = "Skiller";
let typed = "",
  chosenSkiller = ""; // stay when another view was open

const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

export function open(root, app) {
  let names = [],
    wanted = "",
    chosen = "",
    active = null,
    shown = null,
    problem = "",
    skillers = [],
    showsGraphs = true,
    looked = "",
    boardRead = [],
    mapped = new Map(),
    controller = { of: "", name: "" };
  const ask = (path) => path + (skiller() === USUAL ? "" : "?skiller=" + part(skiller()));
  const list = new VirtualList({
    label: "Skills",
    key: (item) => item.name,
    sign: (item) => item.who,
    draw: (item) => [
      el("span", { class: "main-text" }, item.name),
      item.who ? el("span", { class: "dim small" }, item.who) : null,
    ],
    select: (item) => {
      location.hash = "#/skills/" + part(item.name);
    },
  });
  const empty = el("div", { hidden: true });
  const told = el("span", { class: "dim count" });
  const now = el("div", { class: "now", id: "skill-now", role: "status" });
  const graph = el("div", { class: "graph-place", id: "graph" });
  const history = el("div", { id: "calls" }),
    board = el("div"),
    formOf = el("div");
  const input = el("input", {
    type: "text",
    name: "skill",
    id: "skill-string",
    "aria-label": "skill string",
    placeholder: 'say{text="Hello", wait=true}',
    spellcheck: "false",
    autocomplete: "off",
    autocapitalize: "off",
  });
  input.value = typed;
  input.addEventListener("input", () => {
    typed = input.value;
  });
  const callButton = el("button", { type: "submit", class: "primary" }, "Call");
  const stopButton = button(
    "Stop",
    () => app.attempt(() => remove(ask("skiller/skills/active")), "The Skiller is told to stop"),
    { id: "stop-skill" },
  );
  const held = el("p", { class: "dim small", id: "held", hidden: true });
  const form = el("form", { class: "call", id: "call" }, input, callButton, stopButton, held);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const text = input.value.trim();
    if (!text) {
      input.focus();
      return;
    }
    callButton.disabled = true;
    await call(text);
    callButton.disabled = false;
  });
  async function call(text) {
    await app.attempt(() => post(ask("skiller/call"), { skill_string: text }), "Called: " + text);
    readActive();
  }
  const choice = el("select", { "aria-label": "Skiller", id: "skiller" });
  choice.addEventListener("change", () => {
    chosenSkiller = choice.value;
    change();
    if (chosen) location.hash = "#/skills";
  });
  const split = el(
    "div",
    { class: "split" },
    panel(
      "Skills",
      [
        choice,
        told,
        search("Search skills", (text) => {
          wanted = text;
          drawNames();
        }),
      ],
      empty,
      list.box,
    ),
    el(
      "div",
      { class: "detail" },
      el(
        "div",
        { class: "detail-head only-phone" },
        el("a", { class: "back", href: "#/skills", "aria-label": "back to the skills" }, "←"),
      ),
      now,
      formOf,
      form,
      board,
      graph,
      history,
    ),
  );
  split.classList.add("detail-first");
  root.append(split);

  /** The Skiller that is looked at: the chosen one, else the one that had the last call. */
  function skiller() {
    const all = ids();
    if (all.includes(chosenSkiller)) return chosenSkiller;
    const last = app.model.calls.at(-1);
    return last && all.includes(last.skiller)
      ? last.skiller
      : all.includes(USUAL) || !all.length
        ? USUAL
        : all[0];
  }
  function ids() {
    const heard = [...app.model.interfaces.keys()]
      .filter((uid) => uid.startsWith(STATUS))
      .map((uid) => uid.slice(STATUS.length));
    if (!app.recording) return skillers;
    const all = [...new Set([...heard, ...app.model.calls.map((call) => call.skiller)])].sort();
    // Of several agents: AGENT/ID is the same, with its interface
    return all.filter((id) => !all.some((other) => other.endsWith("/" + id)));
  }
  /** Another one is looked at: what was known is of the one before. */
  function change() {
    looked = skiller();
    names = [];
    active = shown = null;
    problem = drawn = drawnCalls = "";
    if (!app.recording) {
      readNames();
      readActive();
    }
    drawNames();
    draw();
  }
  let drawnChoice = "";
  function drawChoice() {
    const all = ids(),
      now = skiller(),
      sign = all.join("\n") + "\n\n" + now;
    choice.hidden = all.length < 2;
    if (sign === drawnChoice) return;
    choice.replaceChildren(...all.map((id) => el("option", { value: id, selected: id === now }, id)));
    if (now !== looked) change();
    drawnChoice = sign;
  }

  async function readSkillers() {
    const found = await get("blackboard/interfaces"),
      debugs = new Set(
        found.filter((each) => each.type + "::" === DEBUG && each.writer).map((each) => each.id),
      );
    skillers = found
      .filter((each) => each.type + "::" === STATUS && each.writer)
      .map((each) => each.id)
      .sort();
    showsGraphs = !skillers.length || debugs.has(skiller());
    if (found.some((each) => each.type === EXECUTOR))
      boardRead = await get("cxbridge/interfaces?type=" + EXECUTOR);
    drawChoice();
  }
  const readNames = throttled(
    async () => {
      await readSkillers();
      mapped = mappedSkills((await get("config").catch(() => ({}))).config);
      names = showsGraphs ? (await get(ask("skiller/skills"))).map((each) => each.name).sort() : [];
      problem = "";
      drawNames();
    },
    SLOW_MS,
    (error) => {
      problem = error.message;
      drawNames();
    },
  );
  const readActive = throttled(
    async () => {
      const of = skiller();
      const answer = showsGraphs ? await get(ask("skiller/skills/active")) : await plainStatus(of);
      if (of !== skiller()) return;
      active = answer;
      draw();
    },
    SOON_MS,
    (error) => {
      active = null;
      problem = error.message;
      draw();
    },
  );
  /** Of a Skiller that shows no graphs: what its interface has. */
  async function plainStatus(id) {
    const { data } = await get(
      "blackboard/interfaces/SkillerInterface/" + id.split("/").map(part).join("/") + "/data",
    );
    return {
      "skill-string": data.skill_string,
      status: data.status,
      error: data.error,
      exclusive_controller: data.exclusive_controller,
      graph: "",
    };
  }
  const readChosen = throttled(
    async () => {
      const name = chosen;
      if (!name) return;
      const answer = await get(ask("skiller/skills/" + part(name)));
      if (name === chosen) {
        shown = answer;
        draw();
      }
    },
    SOON_MS,
    (error) => {
      app.toast(error.message, true);
    },
  );

  /** The executors of the Skiller that is looked at: its name is that of the agent. */
  const executors = () => executorsOf(app.model, boardRead).filter((each) => each.agent === skiller());
  /** The skills by name, with who executes them; of a recording those that were called. */
  function known() {
    const who = new Map(names.map((name) => [name, []]));
    for (const each of executors())
      for (const skill of each.skills) who.set(skill, [...(who.get(skill) || []), each.id]);
    if (app.recording)
      for (const each of app.model.calls) {
        const called = parseCall(each.text);
        if (called && each.skiller === skiller() && !who.has(called.skill)) who.set(called.skill, []);
      }
    return [...who]
      .map(([name, ids]) => ({ name, who: ids.join(", ") }))
      .sort((a, b) => (a.name < b.name ? -1 : 1));
  }
  let drawnNames = "";
  function drawNames() {
    const all = known(),
      items = all.filter((each) => each.name.toLowerCase().includes(wanted));
    drawnNames = JSON.stringify(all);
    told.textContent = all.length ? String(all.length) : "";
    list.box.hidden = !items.length;
    empty.hidden = items.length > 0;
    if (!items.length) {
      empty.replaceChildren(
        app.recording
          ? none("No skills", "A recording has the skills that were called up to its moment.")
          : all.length
            ? none("No skill matches")
            : !showsGraphs && !problem
              ? none(
                  "No list of skills",
                  skiller() +
                    " has no SkillerDebugInterface: it tells neither its skills nor their graphs. It can be called.",
                )
              : none(
                  problem || "No skills",
                  problem ? "" : "The Skiller knows none, or there is no Skiller.",
                ),
      );
    }
    list.set(items);
  }

  /** What the Skiller says of itself: as the API told it, or as its interface was written. */
  function current() {
    const of = skiller(),
      call = app.model.calls.findLast((each) => each.skiller === of);
    const status = app.model.interfaces.get(STATUS + of);
    const debug = app.model.interfaces.get(DEBUG + of);
    const value = { text: "", status: "INACTIVE", error: "", controller: "", graph: "" };
    if (active && !app.recording)
      Object.assign(value, {
        text: active["skill-string"] || "",
        status: active.status,
        error: active.error,
        controller: active.exclusive_controller,
        graph: active.graph,
      });
    if (call) Object.assign(value, { text: call.text, status: call.status });
    if (status)
      Object.assign(value, {
        text: status.values.skill_string,
        status: status.values.status,
        error: status.values.error,
        controller: status.values.exclusive_controller || "",
      });
    // the same interface also has the list of skills, and machines that somebody else asked for
    if (debug && debug.values.graph_fsm === "ACTIVE" && debug.values.graph) value.graph = debug.values.graph;
    return value;
  }

  let drawn = "",
    drawnCalls = "";
  function draw() {
    drawChoice();
    const value = current(),
      drawing = chosen ? (shown && (shown.name === chosen || shown.graph) ? shown.graph : "") : value.graph;
    const isHeld = Boolean(value.controller) && !app.recording; // a Skiller heeds its controller only
    app.gate(stopButton, isHeld || !String(value.status).endsWith("RUNNING"));
    app.gate(callButton, isHeld);
    held.hidden = app.mayChange && !isHeld;
    nameController(value.controller);
    held.textContent =
      app.whyNot ||
      capital(controller.name || "another client") +
        " controls this Skiller: calls are refused until it releases it.";
    form.hidden = Boolean(app.recording);
    const sign = JSON.stringify([value, chosen, drawing, controller.name]);
    if (sign !== drawn) {
      drawn = sign;
      now.replaceChildren(
        el(
          "div",
          { class: "now-line" },
          skillBadge(value.status),
          el("code", { class: "big" }, value.text || "no skill called yet"),
        ),
        pairs([
          ["error", value.error],
          ["controlled by", value.controller && (controller.name || "…")],
        ]),
      );
      const title = chosen
        ? "Skill " + chosen
        : "State graph" + (drawing && !String(value.status).endsWith("RUNNING") ? " of the last skill" : "");
      refill(
        graph,
        el("h3", {}, title, " ", chosen ? el("a", { href: "#/skills" }, "show the active one") : null),
        drawing
          ? drawGraph(drawing, title)
          : none(
              chosen ? "No graph of this skill" : "No state graph yet",
              chosen ? "" : "It is drawn here when a skill runs.",
            ),
      );
      graph.hidden = !drawing && !showsGraphs;
    }
    drawCalls();
    drawBoard();
  }
  function nameController(serial) {
    const of = skiller() + " " + serial;
    if (of === controller.of) return;
    controller = { of, name: "" };
    controllerName(app, skiller(), serial).then((name) => {
      if (controller.of !== of) return;
      controller.name = name;
      draw();
    });
  }
  let drawnBoard = "",
    drawnForm = "";
  function drawBoard() {
    const all = executorsOf(app.model, boardRead),
      sign = JSON.stringify(all);
    if (sign !== drawnBoard) {
      drawnBoard = sign;
      board.replaceChildren(all.length ? executorTable(all) : "");
    }
    if (JSON.stringify(known()) !== drawnNames) drawNames();
    const formSign = app.recording || !chosen ? "" : chosen + " " + mapped.size + " " + skiller();
    if (formSign === drawnForm) return;
    drawnForm = formSign;
    formOf.replaceChildren(
      formSign
        ? el(
            "div",
            {},
            el("h3", {}, "Call " + chosen),
            skillForm(app, chosen, parametersOf(chosen, mapped, app.model.calls), call),
          )
        : "",
    );
  }
  function drawCalls() {
    const of = skiller(),
      calls = app.model.calls
        .filter((call) => call.skiller === of)
        .slice(-50)
        .reverse();
    const sign = JSON.stringify(calls);
    if (sign === drawnCalls) return;
    drawnCalls = sign;
    refill(
      history,
      el("h3", {}, "Calls"),
      calls.length
        ? el(
            "ol",
            { class: "calls" },
            calls.map((call) =>
              el(
                "li",
                {},
                el("span", { class: "dim n" }, clockText(call.begin)),
                skillBadge(call.status),
                el("code", { class: "main-text" }, call.text),
                el("span", { class: "dim n" }, call.end === null ? "" : durationText(call.end - call.begin)),
                app.recording
                  ? null
                  : button(
                      "again",
                      () => {
                        input.value = typed = call.text;
                        input.focus();
                      },
                      { class: "quiet", "aria-label": "again: " + call.text },
                    ),
              ),
            ),
          )
        : el("p", { class: "dim" }, "None yet."),
    );
  }
  const stop = app.model.onChange((topics) => {
    if (topics.has("skills")) {
      if (!app.recording) readActive();
      draw();
    }
    if (topics.has("interfaces")) draw();
  });
  const renewed = app.onRenew(() => {
    readNames();
    readActive();
  });
  looked = skiller();
  if (!app.recording && !app.stream.isWaiting) {
    readNames();
    readActive();
  }
  const heard = app.onTell(draw);
  drawNames();
  draw();
  return {
    go([name = ""]) {
      chosen = name;
      shown = null;
      list.mark(name, true);
      if (name && !app.recording) readChosen();
      draw();
    },
    close() {
      stop();
      renewed();
      heard();
      for (const each of [readNames, readActive, readChosen]) each.stop();
      list.gone();
    },
  };
}
