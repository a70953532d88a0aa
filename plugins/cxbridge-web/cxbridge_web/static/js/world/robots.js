// The robots over time: a lane with the skill calls of each robot, and the state of each robot at a moment.
import { clockText, dim, durationText, el, link, plural, redraw } from "cx/dom.js";
import { OUTCOMES, skillBadge, skillOutcome } from "cx/outcome.js";
import { pathTo, timelineAddress } from "cx/timeline/host.js";
import { robotNames } from "cx/timeline/rows.js";

const MOST_BARS = 400, // of a lane: the latest calls
  MOST_FACTS = 3; // of a robot

/** The skill calls by robot: name -> calls, in the order of names. */
export function robotsOf({ lanes }) {
  const names = robotNames(lanes);
  return new Map(
    [...lanes].map(([lane, calls]) => [names.get(lane), calls]).sort(([a], [b]) => (a < b ? -1 : 1)),
  );
}

/** The call of a robot at a step, or its last call before; null before the first call. */
export const callAt = (calls, step) => calls.findLast(({ begin }) => begin.step <= step) || null;
/** Whether a call has ended at a step. */
export const isOver = (call, step) => Boolean(call.end) && call.end.step <= step;

/**
 * The bar of a call.
 * @param share(time) the place of a time, from 0 to 1
 * @param openEnd the time at which the bar of an open call ends
 */
function bar({ begin, end, status, text, error }, share, openEnd) {
  const outcome = skillOutcome(status),
    { word, icon } = OUTCOMES[outcome],
    [left, right] = [begin.time, end ? end.time : openEnd].map((time) => 100 * share(time)),
    about = {
      class: "lane-bar o-" + outcome,
      style: `left: ${left}%; width: ${Math.max(0, right - left)}%`,
      title: text + " " + word + (error ? ": " + error : ""),
    };
  return el.span(about, outcome !== "completed" && el.i({ "aria-hidden": "true" }, icon), text);
}

/** A lane for each robot, with bars for its calls. A press on a lane chooses a moment. */
export class Lanes {
  /** @param choose(time) called after a press */
  constructor(choose) {
    this.choose = choose;
    this.cursor = el("i.lane-cursor", { "aria-hidden": "true" });
    this.rows = el.div();
    this.box = el("div.lanes-of-robots", this.rows);
  }

  /** @param times from, to and shown (the moment of the cursor), in microseconds */
  draw(robots, history, { from, to, shown }) {
    const share = (time) => (time - from) / Math.max(1, to - from);
    const choose = ({ clientX, currentTarget }) => {
      const { left, width } = currentTarget.getBoundingClientRect();
      this.choose(Math.round(from + ((to - from) * (clientX - left)) / width));
    };
    const lane = ([name, calls]) => {
      const about = { role: "img", "aria-label": name + ": " + plural(calls.length, "skill call") },
        bars = calls.slice(-MOST_BARS).map((call) => bar(call, share, to));
      return el(
        "div.lane",
        el("b.lane-name", name),
        el("div.lane-track", { ...about, on: { pointerdown: choose } }, bars),
      );
    };
    // the bars of open calls grow
    const state = [history.revision, from, history.hasOpenItems ? to : 0];
    if (redraw(this.rows, state, () => [...robots].map(lane)))
      this.rows.querySelector(".lane-track")?.append(this.cursor);
    this.cursor.style.left = 100 * Math.min(1, Math.max(0, share(shown))) + "%";
    this.cursor.style.height = robots.size * 1.9 + "rem"; // the height of .lane in css/map.css
  }
}

/**
 * The state of each robot at a moment.
 * @param placeOf the pose of a robot on the map in words, or ""
 * @param changes the latest changes of facts, see ChangeStore; facts with the name of a robot are its state
 */
export function robotCards(robots, moment, { placeOf, changes }) {
  // from the latest change backwards: a fact that a later change has removed is not present
  const gone = new Set(),
    present = changes.flatMap(({ before, after }) => {
      if (before) gone.add(before);
      return after && !gone.has(after) ? [after] : [];
    });
  return [...robots].map(([name, calls]) => {
    const facts = present.filter((fact) => fact.split(" ").includes(name)).slice(0, MOST_FACTS),
      place = placeOf(name);
    return el(
      "section.robot",
      { "data-robot": name },
      callLines(name, callAt(calls, moment.step), moment),
      place && el("p.small", "at " + place),
      facts.length > 0 && el("p.small.dim", facts.join("; ")),
    );
  });
}

/** The lines about the present or last call of a robot; `call` is null before its first call. */
function callLines(name, call, { step, time }) {
  if (!call) return el.p(el.b(name), " ", dim("has done nothing yet"));
  const { text, status, begin, end, error, action } = call,
    hasEnded = isOver(call, step),
    when = hasEnded
      ? "ended at " + clockText(end.time, 3)
      : "for " + durationText(Math.max(0, time - begin.time)),
    purpose = action && "action " + action.id + " " + action.name + " of " + action.goal;
  return [
    el.p(el.b(name), " ", skillBadge(hasEnded ? status : "S_RUNNING")),
    el.p(el.code(text), " ", dim(when)),
    hasEnded && error && el("p.bad-text", error),
    action && el("p.small", "for ", link(timelineAddress(pathTo(action)), purpose)),
  ];
}
