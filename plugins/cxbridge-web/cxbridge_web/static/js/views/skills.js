// Skills: the present skill of a Skiller with its states, the calls, a call by a skill string.
import { escapePart, get, post, remove } from "cx/api.js";
import { backLink, button, choice, dim, el, form, pairs, redraw, submit, textInput } from "cx/dom.js";
import { skillOf } from "cx/names.js";
import { skillBadge } from "cx/outcome.js";
import { goTo, ListPanel } from "cx/scaffold.js";
import { statesOf, stateTable } from "cx/skills/machine.js";
import {
  callList,
  callsOf,
  DEBUG,
  EXECUTOR,
  executorsOf,
  knownSkills,
  readStatus,
  skillerState,
  STATUS,
} from "cx/skills/skiller.js";
import { nameOfLane } from "cx/timeline/board.js";

export const tab = { title: "Skills", order: 30 };
export const moment = "past";
export const kinds = ["interface"];
const SOON_MS = 500, // the shortest time between two requests for the active skill
  SLOW_MS = 1000; // the shortest time between two requests for the list of skills
const DEFAULT_ID = "Skiller";
// both outlive the view
let typedText = "",
  chosenSkiller = "";

export function open(root, app) {
  let names = [], // of the skills that the Skiller lists
    chosen = "", // the name of a skill
    active = null, // the API's answer about the active skill
    skillers = [], // the ids of the daemon's Skillers
    hasDebug = true, // the Skiller has a SkillerDebugInterface
    shownSkiller = "",
    executorAnswer = []; // the API's answer with the interfaces of executors
  /** The path of a request to the shown Skiller. */
  const pathFor = (path) => path + (skiller() === DEFAULT_ID ? "" : "?skiller=" + escapePart(skiller()));
  const nowBox = el("div#skill-now.now", { role: "status" }),
    machineBox = el("div#machine"),
    callsBox = el("div#calls"),
    heldNote = el("p#held.dim.small", { hidden: true });
  const input = textInput({
    name: "skill",
    id: "skill-string",
    "aria-label": "skill string",
    placeholder: 'say{text="Hello", wait=true}',
    value: typedText,
    on: { input: () => setSkillString(input.value) },
  });
  function setSkillString(text) {
    input.value = typedText = text;
  }
  const callButton = submit("Call"),
    stop = () => app.attempt(() => remove(pathFor("skiller/skills/active")), "The Skiller was asked to stop"),
    stopButton = button("Stop", stop, { id: "stop-skill" });
  async function call() {
    const text = input.value.trim();
    if (!text) {
      input.focus();
      return;
    }
    callButton.disabled = true;
    await app.attempt(() => post(pathFor("skiller/call"), { skill_string: text }), "Called: " + text);
    readActive();
    callButton.disabled = false;
  }
  const callForm = form("#call.call", call, input, callButton, stopButton, heldNote);
  const select = choice({ "aria-label": "Skiller", id: "skiller" }, (id) => {
    chosenSkiller = id;
    changeSkiller();
    if (chosen) goTo("#/skills");
  });
  const backRow = el("div.detail-head.only-phone", backLink("#/skills", "skills"));
  const page = new ListPanel(
    {
      title: "Skills",
      find: "Search skills",
      before: select,
      detail: el("div.detail", backRow, nowBox, callForm, machineBox, callsBox),
      row: {
        key: (item) => item.name,
        sign: (item) => item.executorText + item.status,
        draw: ({ name, executorText, status }) => [
          el("span.main-text", name),
          executorText ? el("span.dim.small", executorText) : null,
          status ? skillBadge(status) : null,
        ],
        select: (item) => goTo("#/skills/" + escapePart(item.name)),
      },
    },
    drawNames,
  );
  page.split.classList.add("detail-first");
  root.append(page.split);

  /**
   * The id of the chosen Skiller, else of the Skiller with the last call, else of the usual or first Skiller.
   */
  function skiller() {
    const ids = skillerIds();
    if (ids.includes(chosenSkiller)) return chosenSkiller;
    const lastCall = app.model.calls.at(-1);
    if (lastCall && ids.includes(lastCall.lane)) return lastCall.lane;
    return ids.includes(DEFAULT_ID) || !ids.length ? DEFAULT_ID : ids[0];
  }
  /** The ids of all Skillers; of a recording, those with an interface or with calls. */
  function skillerIds() {
    if (!app.recording) return skillers;
    const uids = [...app.model.interfaces.keys()].filter((uid) => uid.startsWith(STATUS)),
      lanes = app.model.calls.map(({ lane }) => lane),
      all = [...new Set([...uids.map((uid) => uid.slice(STATUS.length)), ...lanes])].sort();
    // with several agents, the interface AGENT/ID and the lane ID may belong to one Skiller
    return all.filter((id) => !all.some((other) => other.endsWith("/" + id)));
  }
  /** Show another Skiller. */
  function changeSkiller() {
    shownSkiller = skiller();
    names = [];
    active = null;
    page.problem = "";
    for (const box of [nowBox, callsBox]) redraw(box);
    renew();
    draw();
  }
  function drawChoice() {
    const ids = skillerIds(),
      isChanged = select.offer(
        ids.map((id) => [id, nameOfLane(id)]),
        skiller(),
      );
    select.hidden = ids.length < 2;
    if (isChanged && skiller() !== shownSkiller) changeSkiller();
  }

  async function readSkillers() {
    const interfaces = await get("blackboard/interfaces"),
      idsOf = (type) =>
        interfaces.filter((row) => row.type + "::" === type && row.writer).map(({ id }) => id);
    skillers = idsOf(STATUS).sort();
    hasDebug = !skillers.length || idsOf(DEBUG).includes(skiller());
    if (interfaces.some(({ type }) => type === EXECUTOR))
      executorAnswer = await get("cxbridge/interfaces?type=" + EXECUTOR);
    drawChoice();
  }
  const { life } = page;
  const readNames = page.reader(async () => {
    await readSkillers();
    names = hasDebug ? (await get(pathFor("skiller/skills"))).map(({ name }) => name) : [];
  }, SLOW_MS);
  const readActive = life.reader(
    async () => {
      const id = skiller(),
        answer = hasDebug ? await get(pathFor("skiller/skills/active")) : await readStatus(id);
      if (id !== skiller()) return; // another Skiller was chosen during the request
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
  function renew() {
    if (app.recording) return;
    readNames();
    readActive();
  }

  function drawNames() {
    const calls = callsOf(app.model, skiller()),
      // the executors of a Skiller's skill board have the name of its agent, or its own name
      executors = executorsOf(app.model, executorAnswer).filter(({ agent, id }) =>
        [agent, id].includes(nameOfLane(skiller())),
      ),
      all = knownSkills(names, executors, calls),
      hint = app.recording
        ? "A recording shows the skills that were called up to its moment."
        : hasDebug
          ? "The Skiller knows none, or there is no Skiller."
          : skiller() + " has no SkillerDebugInterface, which lists skills. Calls are possible.";
    page.show(
      all.filter(({ name }) => page.matches(name)),
      all.length,
      "No skills",
      hint,
    );
    page.counter.textContent = all.length ? String(all.length) : "";
  }

  function draw() {
    drawChoice();
    const state = skillerState(app.model, skiller(), app.recording ? null : active),
      isRunning = String(state.status).endsWith("RUNNING"),
      isHeld = Boolean(state.controller) && !app.recording; // a Skiller obeys its controller only
    app.gate(stopButton, isHeld || !isRunning);
    app.gate(callButton, isHeld);
    heldNote.hidden = app.mayChange && !isHeld;
    heldNote.textContent =
      app.whyNot ||
      "The executive or another client controls this Skiller: calls are refused until the control is released.";
    callForm.hidden = Boolean(app.recording);
    redraw(nowBox, state, () => [
      el("div.now-line", skillBadge(state.status), el("code.big", state.text || "no skill called yet")),
      pairs([["error", state.error]]),
    ]);
    drawMachine(state.graph, isRunning);
    const calls = callsOf(app.model, skiller(), chosen);
    redraw(callsBox, [chosen, calls], () => [
      el.h3(chosen ? "Calls of " + chosen : "Calls"),
      callList(calls),
    ]);
    drawNames();
  }
  function drawMachine(graph, isRunning) {
    redraw(machineBox, [graph, isRunning], () => {
      const states = statesOf(graph);
      if (!states.size) return [];
      return [el.h3("States", isRunning ? "" : dim(" of the last skill")), stateTable(states)];
    });
  }
  life.add(
    app.model.onChange((topics) => {
      if (topics.has("skills") && !app.recording) readActive();
      if (topics.has("skills") || topics.has("interfaces")) draw();
    }),
    app.onRenew(renew),
    app.onChange(draw),
  );
  shownSkiller = skiller();
  if (!app.stream.isWaiting) renew(); // else the event hello leads to a renewal
  draw();
  return {
    go([name = ""]) {
      chosen = name;
      const [lastCall] = callsOf(app.model, skiller(), name);
      if (name && skillOf(typedText) !== name) setSkillString(lastCall?.text ?? name + "{}");
      page.list.mark(name, true);
      draw();
    },
    close: life.close,
  };
}
