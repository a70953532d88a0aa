// Skills: the running skill and its state graph; calls.
import { get, part, post, remove } from "cx/api.js";
import {
  callList,
  callsOf,
  controllerName,
  DEBUG,
  EXECUTOR,
  executorsOf,
  executorTable,
  knownSkills,
  noSkills,
  readStatus,
  skillerState,
  STATUS,
} from "cx/skills/skiller.js";
import {
  capital,
  backLink,
  button,
  choice,
  el,
  form,
  link,
  none,
  pairs,
  redraw,
  submit,
  textInput,
} from "cx/dom.js";
import { drawGraph } from "cx/graph/draw.js";
import { skillBadge } from "cx/outcome.js";
import { goTo, ListPanel } from "cx/scaffold.js";
import { mappedSkills, parametersOf, skillForm } from "cx/skills/parameters.js";
import { nameOfLane } from "cx/timeline/board.js";

export const tab = { title: "Skills", order: 30 };
export const moment = "past";
export const kinds = ["interface"];
const SOON_MS = 500,
  SLOW_MS = 1000;
const USUAL = "Skiller";
let typed = "",
  chosenSkiller = ""; // stay when another view was open

export function open(root, app) {
  let names = [],
    chosen = "",
    active = null,
    shown = null,
    skillers = [],
    showsGraphs = true,
    looked = "",
    boardRead = [],
    mapped = new Map(),
    controller = { of: "", name: "" };
  const ask = (path) => path + (skiller() === USUAL ? "" : "?skiller=" + part(skiller()));
  const now = el("div#skill-now.now", { role: "status" }),
    graph = el("div#graph.graph-place"),
    history = el("div#calls"),
    board = el.div(),
    formOf = el.div(),
    held = el("p#held.dim.small", { hidden: true });
  const input = textInput({
    name: "skill",
    id: "skill-string",
    "aria-label": "skill string",
    placeholder: 'say{text="Hello", wait=true}',
    value: typed,
    on: { input: () => type(input.value) },
  });
  function type(text) {
    input.value = typed = text;
  }
  const callButton = submit("Call"),
    stop = () => app.attempt(() => remove(ask("skiller/skills/active")), "The Skiller was asked to stop"),
    stopButton = button("Stop", stop, { id: "stop-skill" });
  async function submitted() {
    const text = input.value.trim();
    if (!text) return input.focus();
    callButton.disabled = true;
    await call(text);
    return (callButton.disabled = false);
  }
  async function call(text) {
    await app.attempt(() => post(ask("skiller/call"), { skill_string: text }), "Called: " + text);
    readActive();
  }
  const callForm = form("#call.call", submitted, input, callButton, stopButton, held);
  const select = choice({ "aria-label": "Skiller", id: "skiller" }, (id) => {
    chosenSkiller = id;
    change();
    if (chosen) goTo("#/skills");
  });
  const back = el("div.detail-head.only-phone", backLink("#/skills", "skills"));
  const page = new ListPanel(
    {
      title: "Skills",
      find: "Search skills",
      before: select,
      detail: el("div.detail", back, now, formOf, callForm, board, graph, history),
      row: {
        key: (item) => item.name,
        sign: (item) => item.who,
        draw: ({ name, who }) => [el("span.main-text", name), who ? el("span.dim.small", who) : null],
        select: (item) => goTo("#/skills/" + part(item.name)),
      },
    },
    drawNames,
  );
  page.split.classList.add("detail-first");
  root.append(page.split);

  /** The Skiller that is looked at: the chosen one, else the one that had the last call. */
  function skiller() {
    const all = ids();
    if (all.includes(chosenSkiller)) return chosenSkiller;
    const last = app.model.calls.at(-1);
    return last && all.includes(last.lane) ? last.lane : all.includes(USUAL) || !all.length ? USUAL : all[0];
  }
  function ids() {
    if (!app.recording) return skillers;
    const uids = [...app.model.interfaces.keys()].filter((uid) => uid.startsWith(STATUS)),
      lanes = app.model.calls.map((each) => each.lane),
      all = [...new Set([...uids.map((uid) => uid.slice(STATUS.length)), ...lanes])].sort();
    // Of several agents: AGENT/ID is the same, with its interface
    return all.filter((id) => !all.some((other) => other.endsWith("/" + id)));
  }
  /** Another Skiller is chosen. */
  function change() {
    looked = skiller();
    names = [];
    active = shown = null;
    page.problem = "";
    for (const each of [now, history]) redraw(each);
    renew();
    drawNames();
    draw();
  }
  function drawChoice() {
    const all = ids(),
      isOther = select.offer(
        all.map((id) => [id, nameOfLane(id)]),
        skiller(),
      );
    select.hidden = all.length < 2;
    if (isOther && skiller() !== looked) change();
  }

  async function readSkillers() {
    const found = await get("blackboard/interfaces"),
      idsOf = (type) => found.filter((each) => each.type + "::" === type && each.writer).map(({ id }) => id);
    skillers = idsOf(STATUS).sort();
    showsGraphs = !skillers.length || idsOf(DEBUG).includes(skiller());
    if (found.some((each) => each.type === EXECUTOR))
      boardRead = await get("cxbridge/interfaces?type=" + EXECUTOR);
    drawChoice();
  }
  const { life } = page;
  const readNames = page.reader(async () => {
    await readSkillers();
    mapped = mappedSkills((await get("config").catch(() => ({}))).config);
    names = showsGraphs ? (await get(ask("skiller/skills"))).map((each) => each.name) : [];
  }, SLOW_MS);
  const readActive = life.reader(
    async () => {
      const of = skiller(),
        answer = showsGraphs ? await get(ask("skiller/skills/active")) : await readStatus(of);
      if (of !== skiller()) return;
      active = answer;
      draw();
    },
    SOON_MS,
    (error) => {
      active = null;
      page.problem = error.message;
      draw();
    },
  );
  const readChosen = life.reader(
    async () => {
      const name = chosen,
        answer = name && (await get(ask("skiller/skills/" + part(name))));
      if (!name || name !== chosen) return;
      shown = answer;
      draw();
    },
    SOON_MS,
    (error) => app.toast(error.message, true),
  );
  function renew() {
    if (app.recording) return;
    readNames();
    readActive();
  }

  /** The executors of the Skiller that is looked at: its name is that of the agent, or of the executor itself. */
  const executors = () =>
    executorsOf(app.model, boardRead).filter((each) => [each.agent, each.id].includes(nameOfLane(skiller())));
  const known = () => knownSkills(names, executors(), app.recording ? callsOf(app.model, skiller()) : []);
  let drawnNames = "";
  function drawNames() {
    const all = known(),
      nothing = noSkills({
        isRecording: Boolean(app.recording),
        hasCalls: callsOf(app.model, skiller()).length > 0,
        skiller: skiller(),
        showsGraphs,
        hasGraph: Boolean(graph.querySelector("svg")),
      });
    drawnNames = JSON.stringify(all);
    page.show(
      all.filter((each) => page.matches(each.name)),
      all.length,
      ...nothing,
    );
    page.counter.textContent = all.length ? String(all.length) : "";
  }

  function draw() {
    drawChoice();
    const value = skillerState(app.model, skiller(), app.recording ? null : active),
      isRunning = String(value.status).endsWith("RUNNING"),
      isHeld = Boolean(value.controller) && !app.recording; // a Skiller heeds its controller only
    nameController(value.controller);
    app.gate(stopButton, isHeld || !isRunning);
    app.gate(callButton, isHeld);
    held.hidden = app.mayChange && !isHeld;
    const holder = capital(controller.name || "another client");
    held.textContent =
      app.whyNot || holder + " controls this Skiller: calls are refused until it releases it.";
    callForm.hidden = Boolean(app.recording);
    redraw(now, [value, controller.name], () => [
      el("div.now-line", skillBadge(value.status), el("code.big", value.text || "no skill called yet")),
      pairs([
        ["error", value.error],
        ["controlled by", value.controller && (controller.name || "…")],
      ]),
    ]);
    drawMachine(chosen ? chosenGraph() : value.graph, isRunning);
    const calls = callsOf(app.model, skiller());
    redraw(history, calls, () => [el.h3("Calls"), callList(calls, app.recording ? null : again)]);
    drawBoard(isHeld);
  }
  function again(text) {
    type(text);
    input.focus();
  }
  const chosenGraph = () => (shown && (shown.name === chosen || shown.graph) ? shown.graph : "");
  function drawMachine(drawing, isRunning) {
    const title = chosen
        ? "Skill " + chosen
        : "State graph" + (drawing && !isRunning ? " of the last skill" : ""),
      nothing = chosen
        ? ["No graph of this skill"]
        : ["No state graph yet", "It is drawn here when a skill runs."];
    redraw(graph, [title, drawing], () => [
      el.h3(title, " ", chosen ? link("#/skills", "show the active one") : null),
      drawing ? drawGraph(drawing, title) : none(...nothing),
    ]);
    const mayCome = app.recording ? app.model.interfaces.has(DEBUG + skiller()) : showsGraphs;
    graph.hidden = !drawing && !chosen && !mayCome;
  }
  async function nameController(serial) {
    const of = skiller() + " " + serial;
    if (of === controller.of) return;
    controller = { of, name: "" };
    const name = await controllerName(app, skiller(), serial);
    if (controller.of !== of) return;
    controller.name = name;
    draw();
  }
  function drawBoard(isHeld) {
    const all = executorsOf(app.model, boardRead),
      isForm = chosen && !app.recording;
    redraw(board, all, () => (all.length ? executorTable(all) : ""));
    if (JSON.stringify(known()) !== drawnNames) drawNames();
    redraw(formOf, isForm && [chosen, mapped.size, skiller(), isHeld, app.whyNot], () =>
      isForm
        ? [
            el.h3("Call " + chosen),
            skillForm(app, chosen, parametersOf(chosen, mapped, app.model.calls), call, isHeld),
          ]
        : "",
    );
  }
  life.add(
    app.model.onChange((topics) => {
      if (topics.has("skills") && !app.recording) readActive();
      if (topics.has("skills") || topics.has("interfaces")) draw();
    }),
    app.onRenew(renew),
    app.onChange(draw),
  );
  looked = skiller();
  if (!app.stream.isWaiting) renew();
  drawNames();
  draw();
  return {
    go([name = ""]) {
      chosen = name;
      shown = null;
      page.list.mark(name, true);
      if (name && !app.recording) readChosen();
      draw();
    },
    close: life.close,
  };
}
