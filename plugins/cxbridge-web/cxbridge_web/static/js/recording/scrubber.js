// The bar that plays a recording, and shows the chosen moment of a live run.
import { button, choice, clockText, el } from "cx/dom.js";
import { runAddress } from "cx/not_found.js";

const PLAY_MS = 60,
  SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 50],
  LASTS_S = 20; // the duration of a play at the initial speed
const SHOWS_NOW =
  "This view shows the present: the page keeps only goals, skills, messages and the log of the past.";

/** A choice among the runs of a server. */
function runSelect(runs) {
  const select = choice({ id: "run-choice", "aria-label": "run" }, (path) =>
    location.assign(runAddress(path)),
  );
  select.offer(
    runs.map(({ path, name }) => [path, name]),
    new URLSearchParams(location.search).get("run"),
  );
  return select;
}

export function scrubber(app) {
  const bar = document.getElementById("scrub"),
    slider = el("input#moment", { type: "range", min: 0, step: 1, "aria-label": "moment" }),
    play = button("▶", toggle, { id: "play", "aria-label": "play" }),
    output = el("span#told"),
    runs = app.runs && app.runs.length > 1 ? runSelect(app.runs) : null,
    name = el("b.main-text", { hidden: Boolean(runs) }),
    speeds = choice({ id: "speed", "aria-label": "speed" }, () => {}),
    step = (text, by, label) => button(text, () => app.recording.step(by), { "aria-label": label });
  function toLive() {
    halt();
    if (app.recording) app.look(null);
    else app.select({ time: null });
  }
  const steps = el(
      "div.scrub-line",
      ...[step("◂", -1, "one step back"), play, step("▸", 1, "one step forward"), slider, speeds],
    ),
    live = button("Back to live", toLive, { id: "to-live", hidden: Boolean(app.runs) });
  bar.append(el("div.scrub-line", runs, name, output, el("span.grow"), live), steps);
  let timer = null,
    frame = 0,
    known = null;
  function plays(on) {
    play.textContent = on ? "❙❙" : "▶";
    play.setAttribute("aria-label", on ? "pause" : "play");
  }
  function halt() {
    clearInterval(timer);
    timer = null;
    plays(false);
  }
  function toggle() {
    const { recording } = app;
    if (timer) return halt();
    if (recording.at === recording.events.length) recording.goTo(0);
    plays(true);
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
    return timer;
  }
  slider.addEventListener("input", () => {
    frame ||= requestAnimationFrame(() => {
      frame = 0;
      app.recording?.goToStep(Number(slider.value));
    });
  });
  /** Begin with a recording, at a speed at which the recording takes some seconds. */
  function begin(recording) {
    const speed = Math.max((recording.end - recording.begin) / 1e6 / LASTS_S, SPEEDS[0]);
    known = recording;
    recording.listeners.add(draw);
    slider.max = recording.steps.length;
    name.textContent = recording.name;
    speeds.offer(
      [["step", "step by step"], ...SPEEDS.map((each) => [each, each + "×"])],
      SPEEDS.findLast((each) => each <= speed),
    );
  }
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
    if (recording !== known) begin(recording);
    const { stepNumber: number, steps: all, line } = recording,
      text = clockText(recording.time, 3) + ", " + line;
    slider.value = number;
    output.textContent = "  " + number + " of " + all.length + " · " + text;
    slider.setAttribute("aria-valuetext", text);
  }
  app.onChange(draw);
}
