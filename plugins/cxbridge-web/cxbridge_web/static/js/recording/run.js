// A recorded run at a moment, and the past of a live run as a recording.
import { clockText } from "cx/dom.js";
import { Model } from "cx/model.js";
import { countWhile } from "cx/names.js";
import { goalText } from "cx/outcome.js";
import { History } from "cx/timeline/history.js";

const STEP_KINDS = new Set(["goal", "plan-action", "skill"]);

export class Recording {
  history = new History(); // of the whole run
  readCount = 0; // the number of events in the history
  at = 0; // the number of events up to the moment
  listeners = new Set(); // called after each change of the moment

  /**
   * @param sources the attached CLIPS files; null without them
   * @param options isPast: whether this is the past of a run that continues
   */
  constructor(name, events, notes, sources = null, { isPast = false } = {}) {
    Object.assign(this, { name, notes, sources, isPast });
    this.model = new Model(null, this.history);
    const isOrdered = events.every((event, index) => !index || event.time_us >= events[index - 1].time_us);
    this.events = isOrdered ? events : [...events].sort((a, b) => a.time_us - b.time_us);
    // the number of events up to each step: a step is a transition; in a run without transitions, an event
    this.steps = this.events.flatMap((event, index) => (STEP_KINDS.has(event.kind) ? [index + 1] : []));
    if (!this.steps.length) this.steps = this.events.map((_, index) => index + 1);
    this.environments = [...new Set(this.events.map((event) => event.env).filter(Boolean))].sort();
    this.time = this.begin; // the moment, microseconds
  }

  get begin() {
    const first = this.events[0]?.time_us ?? 0;
    return Math.min(first, this.sources?.startUs ?? first);
  }
  get end() {
    return this.events.at(-1)?.time_us ?? 0;
  }
  /** The number of steps up to the moment. */
  get stepNumber() {
    return countWhile(this.steps, (count) => count <= this.at);
  }

  /** Go to a moment. */
  goToTime(time) {
    this.goTo(this.countBefore(time + 1), Math.max(this.begin, Math.min(this.end, time)));
  }
  /** The number of events before a time. */
  countBefore(time) {
    return countWhile(this.events, (event) => event.time_us < time);
  }
  /** The log lines from one time to another, both included: {time, step, level, component, text}. */
  lines(from, to) {
    return this.events
      .slice(this.countBefore(from), this.countBefore(to + 1))
      .filter(({ kind }) => kind === "log")
      .map(({ time_us: time, level, component, text, step }) => ({ time, step, level, component, text }));
  }

  /**
   * Go to the moment after a number of events.
   * @param time the time of the moment; null: that of the last event, or the begin
   */
  goTo(count, time = null) {
    const wantedCount = Math.max(0, Math.min(this.events.length, count));
    // a model cannot undo events: it starts again
    if (wantedCount < this.at) {
      this.model.clear();
      this.at = 0;
    }
    while (this.readCount < wantedCount) {
      const event = this.events[this.readCount++];
      this.history.apply(event);
      event.step = this.history.steps;
    }
    while (this.at < wantedCount) this.model.apply(this.events[this.at++]);
    this.time = time ?? (this.at ? this.events[this.at - 1].time_us : this.begin);
    for (const listener of this.listeners) listener();
  }
  /** Go to a step; 0: the begin. At the last step the events after it count too, so that the run is whole. */
  goToStep(number) {
    const isLast = number >= this.steps.length;
    this.goTo(number <= 0 ? 0 : isLast ? this.events.length : this.steps[number - 1]);
  }
  step(by) {
    this.goToStep(this.stepNumber + by);
  }

  /** The last step up to the moment, in words. */
  get stepText() {
    const { stepNumber: number } = this,
      event = number && this.events[this.steps[number - 1] - 1];
    if (!event) return "the start";
    const isOlder = clockText(event.time_us, 3) !== clockText(this.time, 3),
      prefix = isOlder ? "nothing new since " + clockText(event.time_us, 3) + ": " : "";
    return prefix + (TEXTS[event.kind] || (({ kind }) => kind))(event);
  }
}

// the text of a step by the kind of its event
const TEXTS = {
  goal: (event) => "goal " + event.goal + " " + goalText(event),
  "plan-action": ({ action, goal, state }) => "action " + action + " of " + goal + " " + state,
  skill: ({ skill_string: text, status }) => "skill " + (text || "none") + " " + status,
  log: ({ component, text }) => component + ": " + text.split("\n", 1)[0],
};

// the kinds of events that the past of a live run needs
const KEPT = new Set(["goal", "plan-action", "skill", "log", "message", "planner"]);
const MOST_EVENTS = 100_000; // the oldest tenth makes room

/** The events of a live run, of which a recording of its past can be made. */
export class Past {
  constructor() {
    this.clear();
  }

  clear() {
    this.events = [];
    this.latest = 0; // the time of the latest event
    this.isWhole = true; // no event was dropped
  }

  /** Keep an event of a kind in KEPT. The oldest events make room. */
  note(event) {
    if (!KEPT.has(event.kind)) return;
    this.events.push(event);
    this.latest = Math.max(this.latest, event.time_us);
    if (this.events.length <= MOST_EVENTS) return;
    this.events.splice(0, MOST_EVENTS / 10);
    this.isWhole = false;
  }

  /** Whether an event of this moment or a later one has come. */
  reaches(time) {
    return this.latest >= time;
  }

  /** The kept events as a recording at its start. */
  recording() {
    const notes = this.isWhole ? [] : ["The page keeps only the last events of a long run."];
    // a recording notes its steps in its events
    const events = this.events.map((event) => ({ ...event }));
    return new Recording("The past of this run", events, notes, null, { isPast: true });
  }
}
