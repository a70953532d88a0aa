// Breakpoints and steps of the executive's rules (docs/debugging.md). Opens by itself when the rules are at a
// break.
import { get, part, post, remove, throttled } from "cx/api.js";
import { button, el } from "cx/dom.js";

const BASE = "cxbridge/debugger",
  LOOK_MS = 700;
const STEPS = [
  ["rule", "one more rule fires"],
  ["loop", "the agenda is empty"],
  ["transition", "a goal or an action changes"],
];

export function debugBar(app) {
  const bar = el("div", { id: "debug-bar", role: "region", "aria-label": "Debugger", hidden: true });
  const toggle = button("Debug", () => show(bar.hidden), {
    id: "debug-open",
    class: "quiet",
    "aria-expanded": "false",
    "aria-controls": "debug-bar",
  });
  const where = el("div", { id: "stopped", role: "status" });
  const points = el("ul", { id: "breakpoints", "aria-label": "breakpoints" });
  const input = el("input", {
    type: "text",
    id: "breakpoint",
    "aria-label": "breakpoint",
    placeholder: "rule:NAME, goal:NAME:MODE, action:NAME:STATE, skill:say*",
    spellcheck: "false",
    autocomplete: "off",
    autocapitalize: "off",
  });
  const add = el("button", { type: "submit" }, "Add breakpoint"),
    form = el("form", { class: "grow-form" }, input, add);
  let stop = null,
    drawnStop = "",
    drawnPoints = "",
    problem = "",
    known = false;

  async function command(call) {
    await app.attempt(async () => take(await call()));
    look();
  }
  const halt = button("Break", () => command(() => post(BASE + "/stop")), {
    id: "debug-break",
    "data-about": "break before the next rule fires",
  });
  const steps = STEPS.map(([what, about]) =>
    button("Step " + what, () => command(() => post(BASE + "/step", { what })), {
      id: "step-" + what,
      "data-about": "continue until " + about,
    }),
  );
  const goOn = button("Continue", () => command(() => post(BASE + "/go-on")), {
    id: "debug-continue",
    class: "primary",
    "data-about": "continue to the next breakpoint",
  });
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const spec = input.value.trim();
    if (!spec) {
      input.focus();
      return;
    }
    if (await app.attempt(() => post(BASE + "/breakpoints", { spec }))) input.value = "";
    look();
  });

  function take(answer) {
    known = true;
    problem = "";
    drawPoints(answer.breakpoints);
    stoppedAt(answer.stopped || null);
  }
  const look = throttled(
    async () => take(await get(BASE)),
    LOOK_MS,
    (error) => {
      problem = error.status === 503 ? "This daemon has no executive." : error.message;
      draw();
    },
  );

  function stoppedAt(next) {
    const sign = JSON.stringify(next);
    if (sign === drawnStop && !problem) {
      draw();
      return;
    }
    const isNew = next && sign !== drawnStop;
    drawnStop = sign;
    stop = next;
    if (isNew) {
      app.renew();
      if (bar.hidden) show(true);
    }
    draw();
  }
  const rule = (name) => el("a", { href: "#/clips/rules/" + part(name) }, name);
  function drawPoints(list) {
    const sign = JSON.stringify([list, app.whyNot]);
    if (sign === drawnPoints) return;
    drawnPoints = sign;
    points.replaceChildren(
      ...list.map((each) =>
        el(
          "li",
          {},
          el("code", {}, each.spec),
          app.gate(
            button("×", () => command(() => remove(BASE + "/breakpoints/" + each.number)), {
              class: "quiet",
              "aria-label": "remove " + each.spec,
            }),
          ),
        ),
      ),
    );
  }
  function words() {
    if (problem) return [problem];
    if (!known) return ["…"];
    if (!stop) return ["The rules run."];
    return [
      el("b", {}, "❙❙ Break: "),
      stop.reason || stop.kind || "",
      stop.rule ? [" · after ", rule(stop.rule)] : "",
      stop.next_rule ? [" · next ", rule(stop.next_rule)] : " · the agenda is empty",
      el("span", { class: "dim" }, " · loop " + stop.loop + ", " + stop.fired + " fired"),
    ];
  }
  function show(on) {
    bar.hidden = !on;
    if (on) look();
    draw();
  }
  let drawnWhere = "";
  function draw() {
    toggle.hidden = Boolean(app.recording || app.runs);
    if (toggle.hidden) bar.hidden = true;
    toggle.setAttribute("aria-expanded", String(!bar.hidden));
    toggle.classList.toggle("is-stopped", Boolean(stop));
    bar.classList.toggle("is-stopped", Boolean(stop));
    const sign = JSON.stringify([stop, problem, known]);
    if (sign !== drawnWhere) {
      drawnWhere = sign;
      where.replaceChildren(...words().flat());
    }
    for (const each of [halt, ...steps, goOn, add])
      app.gate(each, Boolean(problem) || (each === goOn && !stop) || (each === halt && Boolean(stop)));
    app.gate(input);
  }
  setInterval(() => {
    if (!bar.hidden && !document.hidden && app.connection === "open") look();
  }, LOOK_MS);
  bar.append(where, el("div", { class: "tools" }, halt, steps, goOn), form, points);
  document.getElementById("head").after(bar);
  app.onChange(() => {
    // while the bar is closed the status, which is read anyway, tells of stops
    if (bar.hidden && app.status && !app.recording) stoppedAt(app.status.stopped || null);
    else draw();
  });
  draw();
  return toggle;
}
