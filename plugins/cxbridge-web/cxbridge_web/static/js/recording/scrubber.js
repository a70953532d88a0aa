// The bar that goes through the time of a recording; of a live run it names the moment that is chosen.
import { button, clockText, el } from "cx/dom.js";
import { runAddress } from "cx/not_found.js";

const PLAY_MS = 60,
  SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 50],
  LASTS_S = 20; // a run is played in about this time, unless another speed is chosen
const SHOWS_NOW = "This view shows what is now: the past has goals, skills, messages and the log.";

/** A choice among the runs of a server that has several. */
function runSelect(runs) {
  const chosen = new URLSearchParams(location.search).get("run");
  const select = el(
    "select#run-choice",
    { "aria-label": "run" },
    runs.map(({ path, name }) => el.option({ value: path, selected: path === chosen }, name)),
  );
  select.addEventListener("change", () => location.assign(runAddress(select.value)));
  return select;
}

export function scrubber(app) {
  const bar = document.getElementById("scrub");
  const slider = el("input#moment", { type: "range", min: 0, step: 1, "aria-label": "moment" });
  const play = button("▶", () => toggle(), { id: "play", "aria-label": "play" });
  const output = el("span#told");
  const name = el("b.main-text");
  const runs = app.runs && app.runs.length > 1 ? runSelect(app.runs) : null;
  name.hidden = Boolean(runs);
  const speeds = el(
    "select#speed",
    { "aria-label": "speed" },
    el.option({ value: "step" }, "step by step"),
    SPEEDS.map((speed) => el.option({ value: speed }, speed + "×")),
  );
  const steps = el(
    "div.scrub-line",
    button("◂", () => app.recording.step(-1), { "aria-label": "one step back" }),
    play,
    button("▸", () => app.recording.step(1), { "aria-label": "one step on" }),
    slider,
    speeds,
  );
  bar.append(
    el(
      "div.scrub-line",
      runs,
      name,
      output,
      el("span.grow"),
      button(
        "Back to live",
        () => {
          halt();
          if (app.recording) app.look(null);
          else app.select({ time: null });
        },
        { id: "to-live", hidden: Boolean(app.runs) },
      ),
    ),
    steps,
  );
  let timer = null,
    frame = 0;
  function halt() {
    clearInterval(timer);
    timer = null;
    play.textContent = "▶";
    play.setAttribute("aria-label", "play");
  }
  function toggle() {
    if (timer) {
      halt();
      return;
    }
    const { recording } = app;
    if (recording.at === recording.events.length) recording.goTo(0);
    play.textContent = "❙❙";
    play.setAttribute("aria-label", "pause");
    let last = performance.now();
    timer = setInterval(() => {
      const passed = performance.now() - last;
      if (app.recording !== recording || recording.at === recording.events.length) halt();
      else if (speeds.value !== "step")
        recording.goToTime(recording.time + passed * 1000 * Number(speeds.value));
      else if (passed > 2 * PLAY_MS) recording.step(1);
      else return;
      last = performance.now();
    }, PLAY_MS);
  }
  slider.addEventListener("input", () => {
    if (!frame)
      frame = requestAnimationFrame(() => {
        frame = 0;
        if (app.recording) app.recording.goToStep(Number(slider.value));
      });
  });
  let known = null;
  function draw() {
    const { recording } = app,
      { time } = app.selection.value;
    bar.hidden = !recording && (time === null || Boolean(app.runs));
    steps.hidden = !recording;
    if (!recording) {
      known = null;
      if (time === null) return;
      name.textContent = "At " + clockText(time, 3);
      output.textContent = app.moment ? "" : SHOWS_NOW;
      return;
    }
    if (recording !== known) {
      known = recording;
      recording.listeners.add(draw);
      slider.max = recording.steps.length;
      const speed = (recording.end - recording.begin) / 1e6 / LASTS_S;
      speeds.value = SPEEDS.findLast((each) => each <= Math.max(speed, SPEEDS[0]));
      name.textContent = recording.name;
    }
    slider.value = recording.stepNumber;
    const text = clockText(recording.time, 3) + ", " + recording.line;
    output.textContent = "  " + recording.stepNumber + " of " + recording.steps.length + " · " + text;
    slider.setAttribute("aria-valuetext", text);
  }
  app.onChange(draw);
}
