// The timeline of the live run, or of the open recording.
import { envSelect } from "cx/env.js";
import { Lifetime } from "cx/scaffold.js";
import { PageHost, pathOf } from "cx/timeline/host.js";
import { Timeline } from "cx/timeline/timeline.js";

export const tab = { title: "Timeline", order: 10 };
export const moment = "own";
export const kinds = ["planner"];
const TOPICS = ["goals", "skills", "log", "interfaces"];

export function open(root, app) {
  let timeline = null,
    isFirst = true;
  const life = new Lifetime(),
    host = new PageHost(app, () => timeline.later());
  const chosenEnv = () => {
    timeline.rows.env = app.chosenEnv;
    timeline.relist();
  };
  timeline = new Timeline(host, [envSelect(app, chosenEnv, { all: true })]);
  chosenEnv();
  timeline.box.classList.add("panel");
  root.append(timeline.box);

  const soon = life.paced(
    () => timeline.update(),
    () => host.history.goals.size,
  );
  life.add(
    () => timeline.close(),
    app.model.onChange((topics) => TOPICS.some((topic) => topics.has(topic)) && soon()),
  );
  life.listen(app, "select", ({ detail }) => {
    if (detail.changed.includes("time")) host.momentIs(detail.time);
    timeline.later();
  });
  return {
    go(rest) {
      const { goal, action } = app.selection.value,
        // the selection of another view
        path = isFirst && !rest.length && goal ? { goal, action } : pathOf(rest);
      isFirst = false;
      app.select({ goal: path.goal || "", action: path.action || "", skill: path.skill || "" });
      timeline.show(path);
    },
    close: life.close,
  };
}
