// The bar that plays a recording, and shows the chosen moment of a live run.
import { button, choice, clockText, el } from "cx/dom.js";
import { runAddress } from "cx/not_found.js";

const PLAY_MS = 60, // the period of steps while a recording plays
  SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 50],
  INITIAL_PLAY_S = 20; // a recording plays for at least so long at its initial speed, if SPEEDS allow it
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

/** Fill the bar, and keep it up to date. */
export function scrubber(app) {
  const bar = document.getElementById("scrub"),
    slider = el("input#moment", { type: "range", min: 0, step: 1, "aria-label": "moment" }),
    play = button("▶", toggle, { id: "play", "aria-label": "play" }),
    momentText = el("span#moment-text"),
    runs = app.runs && app.runs.length > 1 ? runSelect(app.runs) : null,
    name = el("b.main-text", { hidden: Boolean(runs) }),
    speeds = choice({ id: "speed", "aria-label": "speed" }, () => {}),
    stepButton = (text, by, label) => button(text, () => app.recording.step(by), { "aria-label": label });
  function toLive() {
    halt();
    if (app.recording) app.look(null);
    else app.select({ time: null });
  }
  const controls = el(
      "div.scrub-line",
      ...[stepButton("◂", -1, "one step back"), play, stepButton("▸", 1, "one step forward")],
      ...[slider, speeds],
    ),
    liveButton = button("Back to live", toLive, { id: "to-live", hidden: Boolean(app.runs) });
  bar.append(el("div.scrub-line", runs, name, momentText, el("span.grow"), liveButton), controls);
  let timer = null,
    frame = 0,
    shownRecording = null;
  function showPlaying(isPlaying) {
    play.textContent = isPlaying ? "❙❙" : "▶";
    play.setAttribute("aria-label", isPlaying ? "pause" : "play");
  }
  function halt() {
    clearInterval(timer);
    timer = null;
    showPlaying(false);
  }
  function toggle() {
    const { recording } = app;
    if (timer) {
      halt();
      return;
    }
    if (recording.at === recording.events.length) recording.goTo(0);
    showPlaying(true);
    let steppedAt = performance.now();
    timer = setInterval(() => {
      const passedMs = performance.now() - steppedAt;
      if (app.recording !== recording || recording.at === recording.events.length) halt();
      else if (speeds.value !== "step")
        recording.goToTime(recording.time + passedMs * 1000 * Number(speeds.value));
      else if (passedMs > 2 * PLAY_MS)
        recording.step(1); // step by step: every second or third period
      else return;
      steppedAt = performance.now();
    }, PLAY_MS);
  }
  slider.addEventListener("input", () => {
    // a slider may move several times a frame
    frame ||= requestAnimationFrame(() => {
      frame = 0;
      app.recording?.goToStep(Number(slider.value));
    });
  });
  /** Show another recording, at the highest speed that takes INITIAL_PLAY_S, or else the lowest. */
  function showRecording(recording) {
    const speed = Math.max((recording.end - recording.begin) / 1e6 / INITIAL_PLAY_S, SPEEDS[0]);
    shownRecording = recording;
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
    controls.hidden = !recording;
    if (!recording) {
      shownRecording = null;
      if (time === null) return;
      name.textContent = "At " + clockText(time, 3);
      momentText.textContent = app.moment ? "" : SHOWS_NOW;
      return;
    }
    if (recording !== shownRecording) showRecording(recording);
    const { stepNumber, steps, stepText } = recording,
      text = clockText(recording.time, 3) + ", " + stepText;
    slider.value = stepNumber;
    momentText.textContent = "  " + stepNumber + " of " + steps.length + " · " + text;
    slider.setAttribute("aria-valuetext", text);
  }
  app.onChange(draw);
}
