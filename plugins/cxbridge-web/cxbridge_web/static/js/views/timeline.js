// The timeline of what happens now, or of the recording that is looked at.
import { paced } from "cx/dom.js";
import { envSelect } from "cx/env.js";
import { PageHost } from "cx/timeline/host.js";
import { pathOf } from "cx/timeline/path.js";
import { Timeline } from "cx/timeline/timeline.js";

export const tab = { title: "Timeline", order: 10 };
export const moment = "own";
export const kinds = ["planner"];

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
  timeline = new Timeline(host, [envs]);
  timeline.rows.env = app.chosenEnv;
  timeline.box.classList.add("panel");
  root.append(timeline.box);

  const soon = paced(
    () => timeline.update(),
    () => host.history.goals.size,
  );
  const stop = app.model.onChange((topics) => {
    if (["goals", "skills", "log"].some((topic) => topics.has(topic))) soon();
  });
  const moved = ({ detail }) => {
    if (detail.changed.includes("time")) host.momentIs(detail.time);
    timeline.later();
  };
  const recolour = () => timeline.recolour();
  app.addEventListener("select", moved);
  app.addEventListener("theme", recolour);
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
      stop();
      app.removeEventListener("select", moved);
      app.removeEventListener("theme", recolour);
      soon.stop();
      timeline.close();
    },
  };
}
