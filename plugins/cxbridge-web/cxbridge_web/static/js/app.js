// The state that views share: the model with its event stream, the selection, the daemon's status.
import SITE from "shared/site.js";
import { get, post, throttled } from "cx/api.js";
import { countFrom, el, plural } from "cx/dom.js";
import { readModels } from "cx/env.js";
import { Model } from "cx/model.js";
import { MAIN_ENV } from "cx/names.js";
import { openPast } from "cx/recording/open.js";
import { Past } from "cx/recording/run.js";
import { Selection } from "cx/selection.js";
import { Stream } from "cx/stream.js";

// the kinds of events that every view needs
const ALWAYS = ["goal", "plan-action", "skill", "log", "message"];
const STATUS_MS = 2000, // the period of reading the status
  GOALS_MS = 30000, // the period of reading the goals, which also come as events
  LEAST_PERIOD_MS = 1000, // the shortest time between two equal requests
  STATUS_LASTS_MS = 6000; // how long the clock runs on without a status: three periods
const MOST_TOASTS = 4, // shown at once; the oldest gives way
  TOAST_MS = 4000, // how long a toast is shown
  ERROR_TOAST_MS = 8000; // the same for errors

class App extends EventTarget {
  selection = new Selection(this);
  runs = SITE.runs; // the recordings of `cxbridge view`; null: the page of a daemon or a run
  hasNoRun = false; // no recording could be opened
  live = new Model(() => this.readGoals());
  past = new Past();
  moment = ""; // how the open view shows a chosen moment of a live run: see toMoment()
  model = this.live;
  recording = null;
  status = null;
  goalsProblem = "";
  connection = "connecting";
  lostBecause = "";
  listeners = new Set(); // called after each change of the app's state
  renewals = new Set(); // called to read the lists of a view again
  viewKinds = []; // kinds of events of the open view
  plotKinds = []; // kinds of events of plotted series
  stream = new Stream({
    event: (event) => this.live.apply(event),
    state: (state) => this.connectionIs(state),
    hello: () => this.renew(),
    restarted: () => {
      this.live.clear();
      this.past.clear();
      this.toast("The daemon was restarted: the page starts with its new run");
    },
    // the list of goals that was read first is older than the events that had to wait
    caughtUp: () => this.readGoals(),
    dropped: ({ count }) => {
      this.toast("Missed " + plural(count, "event") + ": the page reads the views again");
      this.renew();
    },
  });
  readGoals = throttled(
    async () => {
      const { env } = this,
        storeGoals = (goals) => this.live.goalsAre(goals, env, this.now);
      await this.live.update(() => readModels(env, "goals"), storeGoals);
      this.goalsProblem = "";
    },
    LEAST_PERIOD_MS,
    (error) => {
      this.goalsProblem = error.message;
      this.live.touch("goals");
    },
  );
  // a failed request keeps the last status: the stream reports a lost connection
  readStatus = throttled(async () => this.statusIs(await get("cxbridge/status")), LEAST_PERIOD_MS);

  constructor() {
    super();
    this.live.onEvent((event) => this.past.note(event));
    this.live.onChange(() => this.lookBack());
    this.addEventListener("select", ({ detail: { changed, time } }) => {
      const { recording } = this;
      if (!changed.includes("time")) return;
      if (recording && time !== null && time !== recording.time) recording.goToTime(time);
      if (recording) return;
      this.lookBack();
      this.notify();
    });
  }

  start() {
    if (this.runs) return;
    this.wants([]);
    const mayRead = () => !document.hidden && this.connection === "open";
    setInterval(() => mayRead() && this.readStatus(), STATUS_MS);
    setInterval(() => mayRead() && !this.recording && this.readGoals(), GOALS_MS);
  }

  /** Follow these kinds of events for the open view. */
  wants(kinds) {
    this.viewKinds = kinds;
    if (this.runs) return;
    this.stream.follow([...ALWAYS, ...this.plotKinds, ...kinds]);
  }
  /** Follow these kinds of events in every view, so that plotted series have no gaps. */
  keep(kinds) {
    this.plotKinds = kinds;
    this.wants(this.viewKinds);
  }

  /** Store the state of the connection. @param state see Stream: "connecting", "open" or "lost" */
  connectionIs(state) {
    if (state === "lost") this.findLostReason();
    if (state === this.connection) return;
    this.connection = state;
    this.notify();
  }

  /** Find out why the connection was lost: unlike a refused stream, a refused request has a reason. */
  async findLostReason() {
    const reasonOf = ({ status, message }) =>
      status === 401
        ? "The daemon wants another token: load the page again and enter it."
        : status
          ? message
          : "";
    const reason = await get("cxbridge/status").then(() => "", reasonOf);
    if (reason === this.lostBecause) return;
    this.lostBecause = reason;
    this.notify();
  }

  /** Read all lists again: events may be lost before a new connection. */
  renew() {
    this.readStatus();
    this.readGoals();
    for (const renewal of this.renewals) renewal();
  }

  /** Call a function when lists have to be read again. Returns a function that ends this. */
  onRenew(call) {
    this.renewals.add(call);
    return () => this.renewals.delete(call);
  }

  /** Read the first status, whose start of the run is the zero of times; wait at most LEAST_PERIOD_MS. */
  async firstStatus() {
    const timeout = new Promise((done) => {
      setTimeout(done, LEAST_PERIOD_MS);
    });
    const store = (status) => this.statusIs(status);
    // a failed request leaves the page without a status; the stream reports the lost connection
    await Promise.race([get("cxbridge/status").then(store, () => {}), timeout]);
  }

  /** Store the daemon's status, which has come just now. */
  statusIs(status) {
    this.status = status;
    this.statusAt = performance.now();
    this.notify();
  }

  /** Send a command to the daemon. @param verb pause, resume, reset or interrupt */
  async command(verb) {
    await this.attempt(async () => this.statusIs(await post("cxbridge/" + verb)));
    this.readGoals();
  }

  /** Await a call, and show its error, or the text `success`. Returns whether the call succeeded. */
  async attempt(call, success = "") {
    try {
      await call();
      if (success) this.toast(success);
      return true;
    } catch (error) {
      this.toast(error.message, true);
      return false;
    }
  }

  /** Call a function after each change of the app's state. Returns a function that ends this. */
  onChange(call) {
    this.listeners.add(call);
    return () => this.listeners.delete(call);
  }
  /** Apply a change of the app's state to texts of times and gated controls, and call the listeners. */
  notify() {
    countFrom(this.zero);
    for (const node of document.querySelectorAll("[data-gate]"))
      this.gate(node, node.dataset.gate === "shut");
    for (const listener of [...this.listeners]) listener();
  }

  /** The start of the run, microseconds; null: unknown. */
  get zero() {
    if (this.recording && !this.recording.isPast) return this.recording.begin;
    return this.status ? this.status.started_us : null;
  }

  /** The shown moment of the recording, or the daemon's clock; microseconds. */
  get now() {
    const { time } = this.model;
    if (this.recording || !this.status) return time;
    const statusAgeMs = performance.now() - this.statusAt,
      isStanding = ["PAUSED", "FINISHED"].includes(this.status.state),
      isRunning = this.status.clock === "real" && !isStanding && statusAgeMs < STATUS_LASTS_MS;
    return Math.max(time, this.status.now_us + (isRunning ? statusAgeMs * 1000 : 0));
  }
  /** Why controls are disabled; "": they are enabled. */
  get whyNot() {
    if (this.recording) return this.recording.isPast ? "This moment is past" : "This is a recording";
    if (this.runs) return "There is no daemon";
    if (this.connection === "lost") return "The daemon does not answer";
    const isOff = this.status?.remote_control === false;
    return isOff ? "remote-control is off in the daemon's configuration" : "";
  }
  get mayChange() {
    return this.whyNot === "";
  }
  get environments() {
    if (this.recording) return this.recording.environments;
    return this.status?.environments.map(({ name }) => name) ?? [];
  }
  /**
   * Change the selection, and dispatch an event `select`.
   * @param changes new values for goal (its key in the model), action, skill, time (microseconds; null: now)
   * and env; the names that it lacks keep their values
   */
  select(changes) {
    this.selection.merge(changes);
  }
  /** The chosen environment; "": none. */
  get chosenEnv() {
    return this.selection.value.env;
  }
  set chosenEnv(env) {
    this.select({ env });
  }
  /** The shown environment: the chosen environment, else the executive's. */
  get env() {
    const { environments } = this;
    if (environments.includes(this.chosenEnv)) return this.chosenEnv;
    return environments.includes(MAIN_ENV) || !environments.length ? MAIN_ENV : environments[0];
  }

  /**
   * Disable a control, with the reason as its title, while the daemon refuses changes.
   * @param isShut whether to disable the control in any case
   */
  gate(node, isShut = false) {
    const { whyNot } = this;
    node.dataset.gate = isShut ? "shut" : "open"; // notify() applies it again
    node.disabled = Boolean(whyNot) || isShut;
    if (whyNot) node.title = whyNot;
    else node.removeAttribute("title");
    return node;
  }

  /** Show a recording; null: the live run. */
  look(recording) {
    this.recording = recording;
    this.model = recording ? recording.model : this.live;
    const { time } = this.selection.value;
    if (recording) {
      const isWithin = time !== null && time >= recording.begin && time < recording.end;
      if (isWithin || (recording.isPast && time !== null)) recording.goToTime(time);
      recording.listeners.add(() => {
        if (this.recording === recording) this.select({ time: recording.time });
      });
    } else this.select({ time: null });
    this.selection.write(); // the view reads the address when it opens
    countFrom(this.zero);
    this.notify();
    this.reopen(); // main.js sets this method
  }

  /**
   * Show the selected moment of a live run in a view that opens.
   * @param ability "own": the view draws the moment; "past": the view shows a recording of the past;
   * undefined: the view shows the present
   */
  toMoment(ability) {
    if (this.recording && this.recording.isPast && ability !== "past") {
      this.recording = null;
      this.model = this.live;
    }
    this.moment = ability || "";
    this.lookBack();
    this.notify();
  }
  /** Open the past of the live run at the selected moment, if the view wants that and the past is known. */
  lookBack() {
    const { time } = this.selection.value;
    if (this.recording || this.isOpening || this.moment !== "past") return;
    if (time === null || !this.past.reaches(time)) return;
    this.isOpening = true;
    openPast(this, this.past.recording()).finally(() => {
      this.isOpening = false;
    });
  }

  toast(text, isError = false) {
    const toast = el.p({ class: "toast" + (isError ? " bad" : "") }, text);
    const toasts = document.getElementById("toasts");
    toasts.append(toast);
    while (toasts.children.length > MOST_TOASTS) toasts.firstChild.remove();
    setTimeout(() => toast.remove(), isError ? ERROR_TOAST_MS : TOAST_MS);
  }
}

export const app = new App();
