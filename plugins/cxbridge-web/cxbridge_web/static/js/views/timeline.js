// The timeline of the live run, or of the open recording.
import { envSelect } from "cx/env.js";
import { Lifetime } from "cx/scaffold.js";
import { PageHost, pathOf } from "cx/timeline/host.js";
import { Timeline } from "cx/timeline/timeline.js";

export const tab = { title: "Timeline", order: 10 };
export const moment = "own"; // the timeline draws the selected moment, see App.toMoment()
export const kinds = ["planner"];
// the topics of changes that the timeline shows
const TOPICS = ["goals", "skills", "log", "interfaces"];

export function open(root, app) {
  let timeline = null,
    isFirst = true; // the view has not shown an address yet
  const life = new Lifetime(),
    host = new PageHost(app, () => timeline.later());
  const showEnv = () => {
    timeline.rows.env = app.chosenEnv;
    timeline.relist();
  };
  timeline = new Timeline(host, [envSelect(app, showEnv, { hasAll: true })]);
  showEnv();
  timeline.box.classList.add("panel");
  root.append(timeline.box);

  const updateSoon = life.paced(
    () => timeline.update(),
    () => host.history.goals.size,
  );
  life.add(
    () => timeline.close(),
    app.model.onChange((topics) => TOPICS.some((topic) => topics.has(topic)) && updateSoon()),
  );
  life.listen(app, "select", ({ detail }) => {
    if (detail.changed.includes("time")) host.takeMoment(detail.time);
    timeline.later();
  });
  return {
    go(parts) {
      const { goal, action } = app.selection.value,
        // the selection of another view
        path = isFirst && !parts.length && goal ? { goal, action } : pathOf(parts);
      isFirst = false;
      app.select({ goal: path.goal || "", action: path.action || "", skill: path.skill || "" });
      timeline.show(path);
    },
    close: life.close,
  };
}
