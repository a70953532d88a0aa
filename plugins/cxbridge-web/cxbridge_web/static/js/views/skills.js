// Skills: the present skill of a Skiller with its states, the calls, a call by a skill string.
import { get, part, post, remove } from "cx/api.js";
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
const SOON_MS = 500,
  SLOW_MS = 1000;
const USUAL = "Skiller";
let typed = "",
  chosenSkiller = ""; // both outlive the view

export function open(root, app) {
  let names = [],
    chosen = "",
    active = null,
    skillers = [],
    hasDebug = true, // the Skiller has a SkillerDebugInterface
    looked = "",
    executorsRead = [];
  const ask = (path) => path + (skiller() === USUAL ? "" : "?skiller=" + part(skiller()));
  const now = el("div#skill-now.now", { role: "status" }),
    machine = el("div#machine"),
    history = el("div#calls"),
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
  async function call() {
    const text = input.value.trim();
    if (!text) return input.focus();
    callButton.disabled = true;
    await app.attempt(() => post(ask("skiller/call"), { skill_string: text }), "Called: " + text);
    readActive();
    return (callButton.disabled = false);
  }
  const callForm = form("#call.call", call, input, callButton, stopButton, held);
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
      detail: el("div.detail", back, now, callForm, machine, history),
      row: {
        key: (item) => item.name,
        sign: (item) => item.who + item.status,
        draw: ({ name, who, status }) => [
          el("span.main-text", name),
          who ? el("span.dim.small", who) : null,
          status ? skillBadge(status) : null,
        ],
        select: (item) => goTo("#/skills/" + part(item.name)),
      },
    },
    drawNames,
  );
  page.split.classList.add("detail-first");
  root.append(page.split);

  /** The chosen Skiller, else the Skiller with the last call. */
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
    // with several agents, AGENT/ID is the same Skiller with its interface
    return all.filter((id) => !all.some((other) => other.endsWith("/" + id)));
  }
  /** Show another Skiller. */
  function change() {
    looked = skiller();
    names = [];
    active = null;
    page.problem = "";
    for (const each of [now, history]) redraw(each);
    renew();
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
    hasDebug = !skillers.length || idsOf(DEBUG).includes(skiller());
    if (found.some((each) => each.type === EXECUTOR))
      executorsRead = await get("cxbridge/interfaces?type=" + EXECUTOR);
    drawChoice();
  }
  const { life } = page;
  const readNames = page.reader(async () => {
    await readSkillers();
    names = hasDebug ? (await get(ask("skiller/skills"))).map((each) => each.name) : [];
  }, SLOW_MS);
  const readActive = life.reader(
    async () => {
      const of = skiller(),
        answer = hasDebug ? await get(ask("skiller/skills/active")) : await readStatus(of);
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
  function renew() {
    if (app.recording) return;
    readNames();
    readActive();
  }

  function drawNames() {
    const calls = callsOf(app.model, skiller()),
      // the executors of a Skiller's skill board have the name of its agent, or its own name
      executors = executorsOf(app.model, executorsRead).filter(({ agent, id }) =>
        [agent, id].includes(nameOfLane(skiller())),
      ),
      all = knownSkills(names, executors, calls),
      hint = app.recording
        ? "A recording shows the skills that were called up to its moment."
        : hasDebug
          ? "The Skiller knows none, or there is no Skiller."
          : skiller() + " has no SkillerDebugInterface, which lists skills. It can be called.";
    page.show(
      all.filter((each) => page.matches(each.name)),
      all.length,
      "No skills",
      hint,
    );
    page.counter.textContent = all.length ? String(all.length) : "";
  }

  function draw() {
    drawChoice();
    const value = skillerState(app.model, skiller(), app.recording ? null : active),
      isRunning = String(value.status).endsWith("RUNNING"),
      isHeld = Boolean(value.controller) && !app.recording; // a Skiller obeys its controller only
    app.gate(stopButton, isHeld || !isRunning);
    app.gate(callButton, isHeld);
    held.hidden = app.mayChange && !isHeld;
    held.textContent =
      app.whyNot ||
      "The executive or another client controls this Skiller: calls are refused until it releases it.";
    callForm.hidden = Boolean(app.recording);
    redraw(now, value, () => [
      el("div.now-line", skillBadge(value.status), el("code.big", value.text || "no skill called yet")),
      pairs([["error", value.error]]),
    ]);
    drawMachine(value.graph, isRunning);
    const calls = callsOf(app.model, skiller(), chosen);
    redraw(history, [chosen, calls], () => [el.h3(chosen ? "Calls of " + chosen : "Calls"), callList(calls)]);
    drawNames();
  }
  function drawMachine(graph, isRunning) {
    redraw(machine, [graph, isRunning], () => {
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
  looked = skiller();
  if (!app.stream.isWaiting) renew();
  draw();
  return {
    go([name = ""]) {
      chosen = name;
      const [last] = callsOf(app.model, skiller(), name);
      if (name && skillOf(typed) !== name) type(last?.text ?? name + "{}");
      page.list.mark(name, true);
      draw();
    },
    close: life.close,
  };
}
