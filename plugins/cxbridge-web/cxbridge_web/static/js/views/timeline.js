// The timeline of what happens now, or of the recording that is looked at.
import { get, part } from "cx/api.js";
import { paced, zeroOfTimes } from "cx/dom.js";
import { envSelect } from "cx/env.js";
import { MAIN_ENV } from "cx/names.js";
import { partsOf, pathOf } from "cx/timeline/path.js";
import { Timeline } from "cx/timeline/timeline.js";

export const tab = { title: "Timeline", order: 10 };
export const moment = "own";
export const kinds = ["planner"];

const address = (path) => ["#/timeline", ...partsOf(path).map(part)].join("/");

/** What the timeline asks of this page. */
class PageHost {
  constructor(app, show) {
    this.app = app;
    this.show = show;
    this.at = null; // of what happens now: the chosen moment
    this.isLive = !app.recording;
    this.explain = app.recording
      ? null
      : async (goal) => {
          if (goal.env !== MAIN_ENV) return [];
          try {
            return (await get("cxbridge/why?goal=" + part(goal.id))).lines;
          } catch (error) {
            return [error.message];
          }
        };
  }
  get history() {
    return this.app.model.history;
  }
  get zero() {
    return zeroOfTimes();
  }
  now() {
    return this.isLive
      ? { time: Math.max(this.app.now, this.history.time), step: this.history.steps }
      : this.history.end;
  }
  cursor() {
    return this.isLive ? this.at : { time: this.app.recording.time, step: this.app.model.step };
  }
  setCursor(point) {
    if (this.isLive) this.at = point;
    this.app.select({ time: point && point.time });
    this.show();
  }
  href(path) {
    return address(path);
  }
  go(path, isReplaced = false) {
    const wanted = address(path);
    if (isReplaced) {
      history.replaceState(history.state, "", wanted);
      dispatchEvent(new HashChangeEvent("hashchange"));
    } else location.hash = wanted;
  }
  lines(from, to) {
    if (!this.isLive) return this.app.recording.lines(from.time, to.time);
    return this.app.model.log
      .filter(({ time }) => time >= from.time && time <= to.time)
      .map((line) => ({ ...line, step: this.history.stepsUpTo(line.time) }));
  }
  links({ goal }) {
    return goal ? [["#/goals/" + part(goal), "In Goals"]] : [];
  }
}

export function open(root, app) {
  let timeline = null;
  const host = new PageHost(app, () => timeline.later());
  const envs = envSelect(
    app,
    () => {
      timeline.rows.env = app.chosenEnv;
      timeline.relist();
    },
    { all: true },
  );
  timeline = new Timeline(host, { tools: [envs] });
  timeline.rows.env = app.chosenEnv;
  timeline.box.classList.add("panel");
  root.append(timeline.box);

  const soon = paced(
    () => timeline.update(),
    () => host.history.goals.size,
  );
  const stops = [
    app.model.onChange((topics) => {
      if (["goals", "skills", "log"].some((topic) => topics.has(topic))) soon();
    }),
  ];
  const moved = ({ detail }) => {
    if (host.isLive && detail.changed.includes("time"))
      host.at =
        detail.time === null ? null : { time: detail.time, step: host.history.stepsUpTo(detail.time) };
    timeline.later();
  };
  app.addEventListener("select", moved);
  const recolour = () => timeline.recolour();
  app.addEventListener("theme", recolour);
  stops.push(() => {
    app.removeEventListener("select", moved);
    app.removeEventListener("theme", recolour);
  });
  let isFirst = true;
  return {
    go(rest) {
      let path = pathOf(rest);
      if (isFirst && !rest.length && app.selection.value.goal) {
        // what was chosen in another view is shown here, too
        const { goal, action } = app.selection.value;
        path = { goal, action };
      }
      isFirst = false;
      app.select({ goal: path.goal || "", action: path.action || "", skill: path.skill || "" });
      timeline.show(path);
    },
    close() {
      for (const stop of stops) stop();
      soon.stop();
      timeline.close();
    },
  };
}
