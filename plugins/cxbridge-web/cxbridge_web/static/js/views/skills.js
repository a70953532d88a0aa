// Skills: what runs, its state graph, to call and to stop.
import { get, part, post, remove, throttled } from "cx/api.js";
import { button, el, none, pairs, panel, refill, search } from "cx/dom.js";
import { controllerName } from "cx/controller.js";
import { drawGraph } from "cx/graph/draw.js";
import { skillBadge } from "cx/looks.js";
import { EXECUTOR, executorsOf, executorTable } from "cx/skills/executors.js";
import { skillForm } from "cx/skills/form.js";
import { knownSkills, noSkills } from "cx/skills/known.js";
import { callList, callsOf, DEBUG, readStatus, skillerState, STATUS } from "cx/skills/now.js";
import { mappedSkills, parametersOf } from "cx/skills/parameters.js";
import { nameOfLane } from "cx/timeline/board.js";
import { VirtualList } from "cx/virtual.js";

export const tab = { title: "Skills", order: 30 };
export const moment = "past";
export const kinds = ["interface"];
const SOON_MS = 500,
  SLOW_MS = 1000;
const USUAL = "Skiller";
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
    controller = { of: "", name: "" },
    isHeld = false;
  const ask = (path) => path + (skiller() === USUAL ? "" : "?skiller=" + part(skiller()));
  const list = new VirtualList({
    label: "Skills",
    key: (item) => item.name,
    sign: (item) => item.who,
    draw: (item) => [el("span.main-text", item.name), item.who ? el("span.dim.small", item.who) : null],
    select: (item) => {
      location.hash = "#/skills/" + part(item.name);
    },
  });
  const empty = el.div({ hidden: true });
  const counter = el("span.dim.count");
  const now = el("div#skill-now.now", { role: "status" });
  const graph = el("div#graph.graph-place");
  const history = el("div#calls"),
    board = el.div(),
    formOf = el.div();
  const input = el("input#skill-string", {
    type: "text",
    name: "skill",
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
  const callButton = el("button.primary", { type: "submit" }, "Call");
  const stopButton = button(
    "Stop",
    () => app.attempt(() => remove(ask("skiller/skills/active")), "The Skiller was asked to stop"),
    { id: "stop-skill" },
  );
  const held = el("p#held.dim.small", { hidden: true });
  const form = el("form#call.call", input, callButton, stopButton, held);
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
  const choice = el("select#skiller", { "aria-label": "Skiller" });
  choice.addEventListener("change", () => {
    chosenSkiller = choice.value;
    change();
    if (chosen) location.hash = "#/skills";
  });
  const split = el(
    "div.split",
    panel(
      "Skills",
      [
        choice,
        counter,
        search("Search skills", (text) => {
          wanted = text;
          drawNames();
        }),
      ],
      empty,
      list.box,
    ),
    el(
      "div.detail",
      el(
        "div.detail-head.only-phone",
        el("a.back", { href: "#/skills", "aria-label": "back to the skills" }, "←"),
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
    return last && all.includes(last.lane) ? last.lane : all.includes(USUAL) || !all.length ? USUAL : all[0];
  }
  function ids() {
    const fromInterfaces = [...app.model.interfaces.keys()]
      .filter((uid) => uid.startsWith(STATUS))
      .map((uid) => uid.slice(STATUS.length));
    if (!app.recording) return skillers;
    const all = [...new Set([...fromInterfaces, ...app.model.calls.map((call) => call.lane)])].sort();
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
    choice.replaceChildren(
      ...all.map((id) => el.option({ value: id, selected: id === now }, nameOfLane(id))),
    );
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
      const answer = showsGraphs ? await get(ask("skiller/skills/active")) : await readStatus(of);
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

  /** The executors of the Skiller that is looked at: its name is that of the agent, or of the executor itself. */
  const executors = () =>
    executorsOf(app.model, boardRead).filter((each) => [each.agent, each.id].includes(nameOfLane(skiller())));
  function known() {
    const calls = app.recording ? callsOf(app.model, skiller()) : [];
    return knownSkills(names, executors(), calls);
  }
  let drawnNames = "";
  function drawNames() {
    const all = known(),
      items = all.filter((each) => each.name.toLowerCase().includes(wanted));
    drawnNames = JSON.stringify(all);
    counter.textContent = all.length ? String(all.length) : "";
    list.box.hidden = !items.length;
    empty.hidden = items.length > 0;
    if (!items.length)
      empty.replaceChildren(
        noSkills({
          isRecording: Boolean(app.recording),
          hasCalls: callsOf(app.model, skiller()).length > 0,
          skiller: skiller(),
          showsGraphs,
          hasGraph: Boolean(graph.querySelector("svg")),
          problem,
          isSearch: all.length > 0,
        }),
      );
    list.set(items);
  }

  let drawn = "",
    drawnCalls = "";
  function draw() {
    drawChoice();
    const value = skillerState(app.model, skiller(), app.recording ? null : active),
      drawing = chosen ? (shown && (shown.name === chosen || shown.graph) ? shown.graph : "") : value.graph;
    isHeld = Boolean(value.controller) && !app.recording; // a Skiller heeds its controller only
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
        el("div.now-line", skillBadge(value.status), el("code.big", value.text || "no skill called yet")),
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
        el.h3(title, " ", chosen ? el.a({ href: "#/skills" }, "show the active one") : null),
        drawing
          ? drawGraph(drawing, title)
          : none(
              chosen ? "No graph of this skill" : "No state graph yet",
              chosen ? "" : "It is drawn here when a skill runs.",
            ),
      );
      const mayCome = app.recording ? app.model.interfaces.has(DEBUG + skiller()) : showsGraphs;
      graph.hidden = !drawing && !chosen && !mayCome;
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
    const formSign =
      app.recording || !chosen ? "" : [chosen, mapped.size, skiller(), isHeld, app.whyNot].join("\n");
    if (formSign === drawnForm) return;
    drawnForm = formSign;
    formOf.replaceChildren(
      formSign
        ? el.div(
            el.h3("Call " + chosen),
            skillForm(app, chosen, parametersOf(chosen, mapped, app.model.calls), call, isHeld),
          )
        : "",
    );
  }
  function drawCalls() {
    const calls = callsOf(app.model, skiller()),
      sign = JSON.stringify(calls);
    if (sign === drawnCalls) return;
    drawnCalls = sign;
    const again = (text) => {
      input.value = typed = text;
      input.focus();
    };
    refill(history, el.h3("Calls"), callList(calls, app.recording ? null : again));
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
  const unsubscribe = app.onChange(draw);
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
      unsubscribe();
      for (const each of [readNames, readActive, readChosen]) each.stop();
      list.gone();
    },
  };
}
