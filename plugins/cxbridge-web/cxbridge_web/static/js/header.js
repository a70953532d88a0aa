// State of the daemon, its clock, pause and resume.
import { debugBar } from "cx/debug.js";
import { button, clockText, el, switchTimes } from "cx/dom.js";
import { stateBadge } from "cx/looks.js";
import { chooseFile } from "cx/recording/open.js";
import { themeSwitch } from "cx/theme.js";

/** Copy the address of what is shown: it has the run, the view, the selection and the moment. */
async function copyLink(app) {
  app.selection.write();
  try {
    await navigator.clipboard.writeText(location.href);
    app.toast("The address of this view, selection and moment is copied");
  } catch {
    prompt("Copy this address", location.href); // a page without TLS may not write to the clipboard
  }
}

/** @param search the button that opens the search over everything */
export function header(app, search) {
  const state = el("span", { id: "state", role: "status" });
  const clock = button(
    "",
    () => {
      switchTimes();
      app.notify();
      app.reopen();
    },
    { id: "clock", class: "quiet", title: "Seconds into the run, or the time of day: press to change" },
  );
  const pause = button("Pause", () => app.command(stalled() ? "interrupt" : paused() ? "resume" : "pause"), {
    id: "pause",
    "aria-keyshortcuts": "p",
  });
  const open = button("Open a recording", () => chooseFile(app), { id: "open-recording", class: "quiet" });
  const link = button("Link", () => copyLink(app), {
    id: "copy-link",
    class: "quiet",
    title: "Copy the address of this view, selection and moment (l)",
  });
  const help = button("?", () => document.getElementById("help").showModal(), {
    class: "quiet",
    "aria-label": "Help",
    title: "Help (?)",
  });
  const readOnly = el(
    "span",
    { id: "read-only", class: "pill", hidden: true },
    "read only",
    el("span", { class: "wide-text" }, ": remote-control is off"),
  );
  const lost = el("p", { id: "lost", class: "note", role: "alert", hidden: true });
  document
    .getElementById("head")
    .append(
      el("h1", { class: "hear-only" }, "cxbridge"),
      el(
        "a",
        { class: "brand", href: "#/", "aria-label": "cxbridge, first view" },
        el("img", { src: document.querySelector("link[rel=icon]").href, alt: "", width: 22, height: 22 }),
        el("span", {}, "cxbridge"),
      ),
      state,
      clock,
      readOnly,
      el("span", { class: "grow" }),
      search,
      debugBar(app),
      pause,
      link,
      open,
      themeSwitch(app),
      help,
    );
  document.getElementById("head").after(lost);

  const paused = () => app.status && app.status.state === "PAUSED";
  const stalled = () => app.status && app.status.stalled;
  let shown = "";
  function draw() {
    const isStopped = app.status && app.status.stopped && app.status.state === "RUNNING";
    const word = app.recording
      ? app.recording.isPast
        ? "PAST"
        : "RECORDING"
      : app.runs
        ? app.hasNoRun
          ? "NO RUN"
          : "READING"
        : app.connection === "lost"
          ? "LOST"
          : !app.status
            ? "CONNECTING"
            : isStopped
              ? "BREAK"
              : app.status.state;
    const result = word === "FINISHED" ? app.status.result : null;
    if (word !== shown) state.replaceChildren(stateBadge(word, result));
    shown = word;
    state.title =
      app.status && !app.recording
        ? (result && result.reason) ||
          app.status.error ||
          app.status.components
            .filter((each) => each.state.toLowerCase() !== "active")
            .map((each) => each.name + ": " + each.state + (each.reason ? ", " + each.reason : ""))
            .join("\n")
        : "";
    pause.textContent = stalled() ? "Interrupt" : paused() ? "Resume" : "Pause";
    pause.title = stalled() || "";
    pause.classList.toggle("primary", Boolean(paused() || stalled()));
    pause.hidden = Boolean(app.recording || app.runs || result);
    app.gate(pause, !app.status || app.connection !== "open");
    readOnly.hidden = Boolean(app.recording) || !app.status || app.status.remote_control !== false;
    readOnly.title = app.whyNot;
    open.hidden = Boolean(app.recording) && !app.runs;
    lost.hidden = app.connection !== "lost" || Boolean(app.recording);
    lost.textContent =
      "The connection to the daemon is lost. What is shown is from " +
      (app.live.time ? clockText(app.live.time) : "before") +
      ". " +
      (app.lostBecause || "Trying again …");
    document.body.classList.toggle("stale", !lost.hidden);
    tick();
  }
  function tick() {
    const time = app.now;
    clock.textContent = time ? clockText(time, app.recording ? 3 : 0) : "–";
  }
  setInterval(tick, 250);
  app.onChange(draw);
  draw();
}
