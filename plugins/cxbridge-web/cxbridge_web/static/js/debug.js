// Breakpoints and steps of the executive's rules (docs/debugging.md). Opens by itself when the rules are at a
// break.
import { get, part, post, remove, throttled } from "cx/api.js";
import { button, dim, el, form, link, redraw, textInput } from "cx/dom.js";

const BASE = "cxbridge/debugger",
  LOOK_MS = 700;
const STEPS = {
  rule: "one more rule fires",
  loop: "the agenda is empty",
  transition: "a goal or an action changes",
};

const rule = (name) => link("#/clips/rules/" + part(name), name);
const placeOf = (stop) => [
  el.b("❙❙ Break: "),
  stop.reason || stop.kind || "",
  stop.rule ? [" · after ", rule(stop.rule)] : "",
  stop.next_rule ? [" · next ", rule(stop.next_rule)] : " · the agenda is empty",
  dim(" · loop " + stop.loop + ", " + stop.fired + " fired"),
];

export function debugBar(app) {
  const bar = el("div#debug-bar", { role: "region", "aria-label": "Debugger", hidden: true });
  const toggle = button("Debug", () => show(bar.hidden), {
    id: "debug-open",
    class: "quiet",
    "aria-expanded": "false",
    "aria-controls": "debug-bar",
  });
  const where = el("div#stopped", { role: "status" }),
    points = el("ul#breakpoints", { "aria-label": "breakpoints" }),
    input = textInput({
      id: "breakpoint",
      "aria-label": "breakpoint",
      placeholder: "rule:NAME, goal:NAME:MODE, action:NAME:STATE, skill:say*",
    }),
    add = el.button({ type: "submit" }, "Add breakpoint");
  let stop = null,
    stopSign = "",
    problem = "",
    known = false;

  async function command(call) {
    await app.attempt(async () => take(await call()));
    look();
  }
  const control = (text, id, about, path, body, more) =>
    button(text, () => command(() => post(BASE + path, body)), { id, "data-about": about, ...more });
  const halt = control("Break", "debug-break", "break before the next rule fires", "/stop");
  const steps = Object.entries(STEPS).map(([what, about]) =>
    control("Step " + what, "step-" + what, "continue until " + about, "/step", { what }),
  );
  const resume = control(
    "Continue",
    "debug-continue",
    "continue to the next breakpoint",
    "/go-on",
    undefined,
    { class: "primary" },
  );
  async function addPoint() {
    const spec = input.value.trim();
    if (!spec) return input.focus();
    if (await app.attempt(() => post(BASE + "/breakpoints", { spec }))) input.value = "";
    return look();
  }

  function take({ breakpoints, stopped = null }) {
    known = true;
    problem = "";
    redraw(points, [breakpoints, app.whyNot], () => breakpoints.map(pointItem));
    stoppedAt(stopped);
  }
  function pointItem({ spec, number }) {
    const leave = () => command(() => remove(BASE + "/breakpoints/" + number));
    return el.li(
      el.code(spec),
      app.gate(button("×", leave, { class: "quiet", "aria-label": "remove " + spec })),
    );
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
    const sign = JSON.stringify(next),
      isNew = next && sign !== stopSign;
    if (sign !== stopSign || problem) stop = next;
    stopSign = sign;
    if (isNew) {
      app.renew();
      if (bar.hidden) show(true);
    }
    draw();
  }
  function show(on) {
    bar.hidden = !on;
    if (on) look();
    draw();
  }
  function draw() {
    toggle.hidden = Boolean(app.recording || app.runs);
    if (toggle.hidden) bar.hidden = true;
    toggle.setAttribute("aria-expanded", String(!bar.hidden));
    for (const each of [toggle, bar]) each.classList.toggle("is-stopped", Boolean(stop));
    redraw(where, [stop, problem, known], () =>
      problem || !known ? problem || "…" : stop ? placeOf(stop) : "The rules run.",
    );
    for (const each of [halt, ...steps, resume, add])
      app.gate(each, Boolean(problem) || (each === resume && !stop) || (each === halt && Boolean(stop)));
    app.gate(input);
  }
  setInterval(() => {
    if (!bar.hidden && !document.hidden && app.connection === "open") look();
  }, LOOK_MS);
  const tools = el("div.tools", halt, steps, resume);
  bar.append(where, tools, form(".grow-form", addPoint, input, add), points);
  document.getElementById("head").after(bar);
  app.onChange(() => {
    // while the bar is closed the status, which is read anyway, tells of stops
    if (bar.hidden && app.status && !app.recording) stoppedAt(app.status.stopped || null);
    else draw();
  });
  draw();
  return toggle;
}
