// Breakpoints and steps of the executive's rules, over RequestInterface of the daemon's blackboard (docs/debugging.md).
import { ApiError, get, post, throttled } from "./api.js";
import { button, el } from "./dom.js";

const PATH = "blackboard/interfaces/RequestInterface/cxbridge/data";
const SEND = "cxbridge/blackboard/RequestInterface/cxbridge/messages";
const POLL_MS = 60, ANSWER_MS = 5000, LOOK_MS = 700;
const pause = (ms) => new Promise((done) => { setTimeout(done, ms); });

/** Have the daemon do something; returns its answer. */
async function ask(verb, more = {}) {
  const token = Math.random().toString(16).slice(2) + Date.now().toString(16);
  await post(SEND, { type: "AskMessage", fields: { verb, token, arguments: JSON.stringify(more) } });
  for (const end = performance.now() + ANSWER_MS; performance.now() < end;) {
    const answer = JSON.parse((await get(PATH)).data.answer || "{}");
    if (answer.token === token) {
      if (answer.error) throw new ApiError(400, answer.error + (answer.hint ? " (" + answer.hint + ")" : ""));
      return answer.result;
    }
    await pause(POLL_MS);
  }
  throw new ApiError(0, "The executive does not answer");
}

export function debugBar(app) {
  const bar = el("div", { id: "debug-bar", role: "region", "aria-label": "Debugger", hidden: true });
  const toggle = button("Debug", () => { bar.hidden = !bar.hidden; draw(); look(); }, { id: "debug-open", class: "quiet", "aria-expanded": "false", "aria-controls": "debug-bar" });
  const where = el("p", { id: "stopped", role: "status" });
  const points = el("ul", { id: "breakpoints", "aria-label": "breakpoints" });
  const input = el("input", { type: "text", id: "breakpoint", "aria-label": "breakpoint", placeholder: "rule:NAME, goal:NAME:MODE, action:NAME:STATE, skill:say*", spellcheck: "false", autocomplete: "off", autocapitalize: "off" });
  const form = el("form", { class: "grow-form" }, input, el("button", { type: "submit" }, "Add breakpoint"));
  let stops = -1, drawn = "";

  async function tell(verb, more) {
    await app.attempt(() => ask(verb, more));
    await readPoints();
    look();
  }
  const buttons = [button("Stop", () => tell("stop"), { id: "debug-stop" }), ...["rule", "loop", "transition"].map((what) => button("Step " + what, () => tell("step", { what }), { id: "step-" + what })),
    button("Go on", () => tell("go-on"), { id: "go-on", class: "primary" })];
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const spec = input.value.trim();
    if (!spec) return;
    if (await app.attempt(() => ask("break-add", { specs: [spec] }))) input.value = "";
    readPoints();
  });
  async function readPoints() {
    const list = await ask("break-list").catch(() => []);
    points.replaceChildren(...list.map((each) => el("li", {}, el("code", {}, each.spec), button("×", () => tell("break-remove", { numbers: [each.number] }), { class: "quiet", "aria-label": "remove " + each.spec }))));
  }
  /** Where the rules stand; asked for while the bar is open. */
  const look = throttled(async () => {
    const { data } = await get(PATH);
    if (data.stops !== stops || data.stopped !== drawn) {
      if (stops !== -1) { app.renew(); }
      stops = data.stops;
      drawn = data.stopped;
    }
    where.textContent = drawn ? "❙❙ " + drawn : "The rules run.";
    bar.classList.toggle("is-stopped", Boolean(drawn));
    draw();
  }, LOOK_MS, (error) => { where.textContent = error.status === 404 ? "This daemon has no executive." : error.message; });

  function draw() {
    toggle.hidden = Boolean(app.recording);
    if (app.recording) bar.hidden = true;
    toggle.setAttribute("aria-expanded", String(!bar.hidden));
    for (const each of [...buttons, ...form.elements]) each.disabled = !app.mayChange || app.connection !== "open" || (each.id === "go-on" && !drawn);
  }
  toggle.addEventListener("click", () => { if (!bar.hidden) readPoints(); });
  setInterval(() => { if (!bar.hidden && !document.hidden && app.connection === "open") look(); }, LOOK_MS);
  bar.append(where, el("div", { class: "tools" }, buttons), form, points);
  document.getElementById("head").after(bar);
  app.onTell(draw);
  draw();
  return toggle;
}
