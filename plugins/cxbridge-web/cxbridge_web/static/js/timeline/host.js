// The page for the timeline, the details and the story: the run, the chosen moment, addresses. A path names a
// goal, action or skill call by the parts of its address: goal/KEY/action/PLAN ID/skill/NUMBER.
import { escapePart } from "cx/api.js";
import { zeroOfTimes } from "cx/dom.js";

const NAMES = ["goal", "action", "skill"];

/** The path in the parts of an address. @returns {{goal?: string, action?: string, skill?: string}} */
export function pathOf(parts) {
  const path = {};
  for (let at = 0; at < parts.length; at++)
    if (NAMES.includes(parts[at]) && parts[at + 1]) path[parts[at]] = parts[++at];
  return path;
}

/** The parts of an address for a path. */
export const partsOf = (path) => NAMES.flatMap((name) => (path[name] ? [name, path[name]] : []));

/** The path of a goal, an action or a skill call. */
export function pathTo(item) {
  if (item.kind === "goal") return { goal: item.key };
  if (item.kind === "action") return { goal: item.goal, action: item.path };
  if (item.kind !== "skill") return {};
  const { action } = item;
  return { ...(action ? pathTo(action) : {}), skill: String(item.number) };
}

/** The goal, the action and the skill call of a path; `item` is the deepest of them. */
export function resolve(path, history) {
  const goal = path.goal && history.goals.get(path.goal),
    action = path.action && history.actions.get(path.goal + "\n" + path.action),
    call = path.skill && history.callOf(Number(path.skill));
  return {
    goal: goal || null,
    action: action || null,
    call: call || null,
    item: call || action || goal || null,
  };
}

/** The address of a path in the timeline. */
export const timelineAddress = (path) => ["#/timeline", ...partsOf(path).map(escapePart)].join("/");

/**
 * @typedef {object} Moment
 * @property {number} time microseconds
 * @property {number} step the number of transitions up to then
 */

/** Connects timeline, details and story with the page. */
export class PageHost {
  /** @param show draws the view again @param href(path) the address of a path */
  constructor(app, show, href = timelineAddress) {
    Object.assign(this, { app, show, href });
    this.chosenMoment = null; // the chosen moment of a live run
    this.isLive = !app.recording;
  }
  get history() {
    return this.app.model.history;
  }
  /** The origin of times, microseconds; null: times are times of day. */
  get zero() {
    return zeroOfTimes();
  }
  /** The end of the run, or now. @returns {Moment} */
  now() {
    return this.isLive
      ? { time: Math.max(this.app.now, this.history.time), step: this.history.steps }
      : this.history.end;
  }
  /** The chosen moment; null: now. @returns {Moment | null} */
  cursor() {
    return this.isLive ? this.chosenMoment : { time: this.app.recording.time, step: this.app.model.step };
  }
  /** Choose a moment; null: now. */
  setCursor(point) {
    if (this.isLive) this.chosenMoment = point;
    this.app.select({ time: point && point.time });
    this.show();
  }
  /** Take a moment that another view chose; null: now. */
  takeMoment(time) {
    if (this.isLive) this.chosenMoment = time === null ? null : { time, step: this.history.stepsUpTo(time) };
  }
  /** Open the address of a path. @param isReplaced whether the browser's history keeps no step for it */
  go(path, isReplaced = false) {
    const address = this.href(path);
    if (isReplaced) {
      history.replaceState(history.state, "", address);
      // replaceState() dispatches no event itself
      dispatchEvent(new HashChangeEvent("hashchange"));
    } else location.hash = address;
  }
  /** The lines of the log between two moments. */
  lines(from, to) {
    if (!this.isLive) return this.app.recording.lines(from.time, to.time);
    return this.app.model.log
      .filter(({ time }) => time >= from.time && time <= to.time)
      .map((line) => ({ ...line, step: this.history.stepsUpTo(line.time) }));
  }
}
