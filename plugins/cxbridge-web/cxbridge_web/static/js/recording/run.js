// A recorded run at one of its moments.
import { Model } from "cx/model.js";
import { History } from "cx/timeline/history.js";

const STEP_KINDS = new Set(["goal", "plan-action", "skill"]);

function inOrder(events) {
  for (let at = 1; at < events.length; at++) {
    // Stable
    if (events[at].time_us < events[at - 1].time_us) return [...events].sort((a, b) => a.time_us - b.time_us);
  }
  return events;
}

export class Recording {
  /**
   * @param sources the attached CLIPS files, null without
   * @param how isPast: of a run that goes on
   */
  constructor(name, events, notes, sources = null, { isPast = false } = {}) {
    this.sources = sources;
    this.isPast = isPast;
    this.name = name;
    this.notes = notes;
    this.history = new History(); // of the whole run, whatever the moment
    this.read = 0; // events that are in the history
    this.model = new Model(null, this.history);
    this.events = inOrder(events);
    // a step is a transition; without any, each event is one
    this.steps = this.events.flatMap((event, at) => (STEP_KINDS.has(event.kind) ? [at + 1] : []));
    if (!this.steps.length) this.steps = this.events.map((_, at) => at + 1);
    this.environments = [...new Set(this.events.map((event) => event.env).filter(Boolean))].sort();
    this.at = 0; // events that have happened
    this.time = this.begin; // the moment, microseconds
    this.listeners = new Set();
  }

  get begin() {
    const first = this.events.length ? this.events[0].time_us : 0;
    return Math.min(first, this.sources?.startUs ?? first);
  }
  get end() {
    return this.events.length ? this.events[this.events.length - 1].time_us : 0;
  }
  /** How many steps have happened. */
  get stepNumber() {
    let low = 0,
      high = this.steps.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.steps[middle] <= this.at) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Go to a moment: all events up to it have happened. */
  goToTime(time) {
    this.goTo(this.countBefore(time + 1), Math.max(this.begin, Math.min(this.end, time)));
  }

  /** The log lines between two times, whatever the moment. */
  lines(from, to) {
    const first = this.countBefore(from);
    const lines = [];
    for (let at = first; at < this.events.length && this.events[at].time_us <= to; at++) {
      const { kind, time_us: time, level, component, text, step } = this.events[at];
      if (kind === "log") lines.push({ time, step, level, component, text });
    }
    return lines;
  }
  /** How many events there were before a time. */
  countBefore(time) {
    let low = 0,
      high = this.events.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.events[middle].time_us < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  goTo(count, time = null) {
    const wanted = Math.max(0, Math.min(this.events.length, count));
    if (wanted < this.at) {
      this.model.clear();
      this.at = 0;
    }
    while (this.read < wanted) {
      const event = this.events[this.read++];
      this.history.apply(event);
      event.step = this.history.steps;
    }
    while (this.at < wanted) this.model.apply(this.events[this.at++]);
    this.time = time ?? (this.at ? this.events[this.at - 1].time_us : this.begin);
    for (const listener of this.listeners) listener();
  }
  goToStep(number) {
    this.goTo(number <= 0 ? 0 : number >= this.steps.length ? this.events.length : this.steps[number - 1]);
  }
  step(by) {
    this.goToStep(this.stepNumber + by);
  }

  /** The last step that happened, in words. */
  get line() {
    const event = this.at ? this.events[this.steps[Math.max(0, this.stepNumber - 1)] - 1] : null;
    if (!event || !this.stepNumber) return "the begin";
    if (event.kind === "goal")
      return (
        "goal " + event.goal + " " + event.mode + (event.outcome === "UNKNOWN" ? "" : " " + event.outcome)
      );
    if (event.kind === "plan-action")
      return "action " + event.action + " of " + event.goal + " " + event.state;
    if (event.kind === "skill") return "skill " + (event.skill_string || "none") + " " + event.status;
    if (event.kind === "log") return event.component + ": " + event.text.split("\n", 1)[0];
    return event.kind;
  }
}
