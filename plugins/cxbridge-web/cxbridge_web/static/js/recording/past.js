// What has happened of a live run, kept so that its past can be looked at as a recording is.
import { Recording } from "cx/recording/run.js";

const KEPT = new Set(["goal", "plan-action", "skill", "log", "message", "planner"]);
const MOST_EVENTS = 100_000;

export class Past {
  constructor() {
    this.clear();
  }

  clear() {
    this.events = [];
    this.latest = 0;
    this.isWhole = true;
  }

  /** Keep an event. Of very many the oldest make room. */
  note(event) {
    if (!KEPT.has(event.kind)) return;
    this.events.push(event);
    this.latest = Math.max(this.latest, event.time_us);
    if (this.events.length <= MOST_EVENTS) return;
    this.events.splice(0, MOST_EVENTS / 10);
    this.isWhole = false;
  }

  /** Whether events up to a moment are there already. */
  reaches(time) {
    return this.latest >= time;
  }

  /** What there is up to now, as a recording at its begin. */
  recording() {
    const notes = this.isWhole ? [] : ["What was long ago is not kept."];
    // a recording notes its steps in its events
    const events = this.events.map((event) => ({ ...event }));
    return new Recording("The past of this run", events, notes, null, { isPast: true });
  }
}
