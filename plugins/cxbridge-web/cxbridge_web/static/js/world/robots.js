// The robots over time: a lane each with its skill calls, and how each one stands at the moment.
import { part } from "cx/api.js";
import { clockText, durationText, el } from "cx/dom.js";
import { skillBadge } from "cx/looks.js";
import { OUTCOMES, skillOutcome } from "cx/outcome.js";
import { partsOf, pathTo } from "cx/timeline/path.js";

const MOST_BARS = 400;

/** The skill calls by robot: name -> calls, in order. */
export function robotsOf(history) {
  const found = new Map();
  for (const call of history.calls) {
    if (!found.has(call.skiller)) found.set(call.skiller, []);
    found.get(call.skiller).push(call);
  }
  return found;
}

/** The call that a robot executes at a step, or its last one before; null: none yet. */
export const callAt = (calls, step) => calls.findLast(({ begin }) => begin.step <= step) || null;
export const isOver = (call, step) => Boolean(call.end) && call.end.step <= step;

function bar(call, from, length, now) {
  const end = call.end ? call.end.time : now,
    outcome = skillOutcome(call.status),
    text = call.text + " " + OUTCOMES[outcome].word + (call.error ? ": " + call.error : "");
  return el.span(
    {
      class: "lane-bar o-" + outcome,
      style:
        "left: " +
        (100 * (call.begin.time - from)) / length +
        "%; width: " +
        (100 * Math.max(0, end - call.begin.time)) / length +
        "%",
      title: text,
    },
    outcome === "completed" ? null : el.i({ "aria-hidden": "true" }, OUTCOMES[outcome].icon),
    call.text,
  );
}

/**
 * Lanes of robots with a cursor.
 * @param choose called with the moment of a press
 */
export class Lanes {
  constructor(choose) {
    this.choose = choose;
    this.cursor = el("i.lane-cursor", { "aria-hidden": "true" });
    this.rows = el.div();
    this.box = el("div.lanes-of-robots", this.rows);
    this.sign = "";
  }

  /** @param from, to microseconds; now: the moment */
  draw(robots, history, { from, to, now }) {
    const length = Math.max(1, to - from);
    const sign = [history.revision, from, history.goesOn ? to : 0].join(" ");
    if (sign !== this.sign) {
      this.sign = sign;
      this.rows.replaceChildren(
        ...[...robots].map(([name, calls]) => {
          const track = el(
            "div.lane-track",
            { role: "img", "aria-label": name + ": " + calls.length + " skill calls" },
            calls.slice(-MOST_BARS).map((call) => bar(call, from, length, to)),
          );
          track.addEventListener("pointerdown", (event) => {
            const { left, width } = track.getBoundingClientRect();
            this.choose(Math.round(from + (length * (event.clientX - left)) / width));
          });
          return el("div.lane", el("b.lane-name", name), track);
        }),
      );
      const [track] = this.rows.querySelectorAll(".lane-track");
      if (track) track.append(this.cursor);
    }
    this.cursor.style.left = 100 * Math.min(1, Math.max(0, (now - from) / length)) + "%";
    this.cursor.style.height = robots.size * 1.9 + "rem";
  }
}

/**
 * How the robots stand at a moment.
 * @param placeOf the pose of a robot on the map, in words; "" without
 * @param known sentences of the latest facts; those that name a robot are its last known state
 */
export function robotCards(robots, { step, time }, { placeOf, known }) {
  const gone = new Set(), // a fact that was retracted later is no state
    present = known.flatMap(({ before, after }) => {
      if (before) gone.add(before);
      return after && !gone.has(after) ? [after] : [];
    });
  return [...robots].map(([name, calls]) => {
    const call = callAt(calls, step),
      over = call && isOver(call, step),
      facts = present.filter((fact) => fact.split(" ").includes(name)).slice(0, 3),
      place = placeOf(name);
    return el(
      "section.robot",
      { "data-robot": name },
      el.p(
        el.b(name),
        " ",
        call ? skillBadge(over ? call.status : "S_RUNNING") : el("span.dim", "has done nothing yet"),
      ),
      call
        ? el.p(
            el.code(call.text),
            " ",
            el(
              "span.dim",
              over
                ? "ended at " + clockText(call.end.time, 3)
                : "for " + durationText(Math.max(0, time - call.begin.time)),
            ),
          )
        : null,
      call && over && call.error ? el("p.bad-text", call.error) : null,
      call && call.action
        ? el(
            "p.small",
            "for ",
            el.a(
              { href: ["#/timeline", ...partsOf(pathTo(call.action)).map(part)].join("/") },
              "action " + call.action.id + " " + call.action.name + " of " + call.action.goal,
            ),
          )
        : null,
      place ? el("p.small", "at " + place) : null,
      facts.length ? el("p.small.dim", facts.join("; ")) : null,
    );
  });
}
