// The bar that goes through the time of a recording.
import { button, el } from "../dom.js";

const PLAY_MS = 120;

export function scrubber(app) {
  const bar = document.getElementById("scrub");
  const slider = el("input", { type: "range", min: 0, step: 1, id: "moment", "aria-label": "moment" });
  const play = button("▶", () => toggle(), { id: "play", "aria-label": "play" });
  const told = el("span", { id: "told" });
  const name = el("b", { class: "main-text" });
  bar.append(
    el(
      "div",
      { class: "scrub-line" },
      name,
      told,
      el("span", { class: "grow" }),
      button(
        "Back to live",
        () => {
          halt();
          app.look(null);
        },
        { id: "to-live" },
      ),
    ),
    el(
      "div",
      { class: "scrub-line" },
      button("◂", () => app.recording.step(-1), { "aria-label": "one step back" }),
      play,
      button("▸", () => app.recording.step(1), { "aria-label": "one step on" }),
      slider,
    ),
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
    timer = setInterval(() => {
      if (app.recording !== recording || recording.at === recording.events.length) halt();
      else recording.step(1);
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
    const { recording } = app;
    bar.hidden = !recording;
    if (!recording) {
      known = null;
      return;
    }
    if (recording !== known) {
      known = recording;
      recording.listeners.add(draw);
      slider.max = recording.steps.length;
      name.textContent = recording.name;
    }
    slider.value = recording.stepNumber;
    const text = ((recording.time - recording.begin) / 1e6).toFixed(3) + " s, " + recording.line;
    told.textContent = "  " + recording.stepNumber + " of " + recording.steps.length + " · " + text;
    slider.setAttribute("aria-valuetext", text);
  }
  app.onTell(draw);
}
