// The header: state and clock of the daemon, pause and resume, links.
import { button, clockText, el, switchTimes } from "cx/dom.js";
import { stateBadge } from "cx/outcome.js";
import { chooseFile } from "cx/recording/open.js";
import { themeSwitch } from "cx/theme.js";

/** Copy the address, which holds the run, the view, the selection and the moment. */
async function copyLink(app) {
  app.selection.write();
  try {
    await navigator.clipboard.writeText(location.href);
    app.toast("The address of this view, selection and moment is copied");
  } catch {
    prompt("Copy this address", location.href); // a page without TLS may not write to the clipboard
  }
}

/** The state of the daemon or the recording, in a word. */
function stateOf({ recording, runs, hasNoRun, connection, status }) {
  if (recording) return recording.isPast ? "PAST" : "RECORDING";
  if (runs) return hasNoRun ? "NO RUN" : "READING";
  if (connection === "lost") return "LOST";
  if (!status) return "CONNECTING";
  return status.stopped && status.state === "RUNNING" ? "BREAK" : status.state;
}
/** The sentence about a stop of the rules; undefined if the rules are not stopped. */
const breakOf = ({ stopped }) => stopped && "The rules are stopped: " + (stopped.reason || stopped.kind);
/** The components that are not active, one a line. */
const troublesOf = ({ components }) =>
  components
    .filter(({ state }) => state.toLowerCase() !== "active")
    .map(({ name, state, reason }) => name + ": " + state + (reason ? ", " + reason : ""))
    .join("\n");

const TICK_MS = 250; // the period of the clock

/** Fill the header. @param search the button of the search over everything */
export function header(app, search) {
  const head = document.getElementById("head"),
    isPaused = () => app.status && (app.status.stopped || app.status.state === "PAUSED"),
    stallReason = () => app.status && app.status.stalled;
  const state = el("span#state", { role: "status" });
  const switchClock = () => {
    switchTimes();
    app.notify();
    app.reopen();
  };
  const clock = button("", switchClock, {
    id: "clock",
    class: "quiet",
    title: "Seconds into the run, or the time of day: press to change",
  });
  const pause = button(
    "Pause",
    () => app.command(stallReason() ? "interrupt" : isPaused() ? "resume" : "pause"),
    {
      id: "pause",
      "aria-keyshortcuts": "p",
    },
  );
  const open = button("Open a recording", () => chooseFile(app), { id: "open-recording", class: "quiet" });
  const copy = button("Link", () => copyLink(app), {
    id: "copy-link",
    class: "quiet",
    title: "Copy the address of this view, selection and moment (l)",
  });
  const help = button("?", () => document.getElementById("help").showModal(), {
    class: "quiet",
    "aria-label": "Help",
    title: "Help (?)",
  });
  const readOnlyReason = el("span.wide-text", ": remote-control is off"),
    readOnly = el("span#read-only.pill", { hidden: true }, "read only", readOnlyReason),
    lost = el("p#lost.note", { role: "alert", hidden: true }),
    icon = document.querySelector("link[rel=icon]").href;
  head.append(
    el("h1.hear-only", "cxbridge"),
    el(
      "a.brand",
      { href: "#/", "aria-label": "cxbridge, first view" },
      el.img({ src: icon, alt: "", width: 22, height: 22 }),
      el.span("cxbridge"),
    ),
    ...[state, clock, readOnly, el("span.grow"), search, pause, copy, open],
    themeSwitch(app),
    help,
  );
  head.after(lost);

  let shownState = "";
  function draw() {
    const { status, recording } = app,
      word = stateOf(app),
      result = word === "FINISHED" ? status.result : null;
    if (word !== shownState) state.replaceChildren(stateBadge(word, result));
    shownState = word;
    state.title =
      status && !recording ? result?.reason || status.error || breakOf(status) || troublesOf(status) : "";
    pause.textContent = stallReason() ? "Interrupt" : isPaused() ? "Resume" : "Pause";
    pause.title = stallReason() || "";
    pause.classList.toggle("primary", Boolean(isPaused() || stallReason()));
    pause.hidden = Boolean(recording || app.runs || result);
    app.gate(pause, !status || app.connection !== "open");
    readOnly.hidden = Boolean(recording) || !status || status.remote_control !== false;
    readOnly.title = app.whyNot;
    open.hidden = Boolean(recording) && !app.runs;
    lost.hidden = app.connection !== "lost" || Boolean(recording);
    const since = app.live.time ? clockText(app.live.time) : "earlier";
    lost.textContent = status?.result
      ? "The program of this run has ended. The page shows the end of the run."
      : `The connection to the daemon is lost. The page shows the state of ${since}. ` +
        (app.lostBecause || "Trying again …");
    document.body.classList.toggle("stale", !lost.hidden);
    tick();
  }
  function tick() {
    clock.textContent = app.now ? clockText(app.now, app.recording ? 3 : 0) : "–";
  }
  setInterval(tick, TICK_MS);
  app.onChange(draw);
  draw();
}
