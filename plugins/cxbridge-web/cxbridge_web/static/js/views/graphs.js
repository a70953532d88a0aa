// Drawings of the blackboard (writers and readers of interfaces) and of the coordinate frames, as in Fawkes'
// webview.
import { get } from "cx/api.js";
import { button, el, none, panel, redraw, refill, search } from "cx/dom.js";
import { drawGraph } from "cx/graph/draw.js";
import { Lifetime } from "cx/scaffold.js";
import { blackboardTabs } from "cx/views/blackboard.js";

export const parts = ["blackboard/graph", "blackboard/transforms"];
export const kinds = [];
const AGAIN_MS = 5000,
  SOON_MS = 500;
const GRAPHS = {
  graph: { title: "Who writes and reads what", path: "blackboard/graph", empty: "No interface is open." },
  transforms: {
    title: "Coordinate frames",
    path: "transforms/graph",
    empty: "No transforms: there is no TransformInterface, and no Position3DInterface of a frame.",
  },
};
const href = (name) => (name.includes("::") ? "#/blackboard/" + encodeURIComponent(name) : "");

export function open(root, app) {
  let which = "graph",
    dot = "",
    problem = "",
    only = "";
  const life = new Lifetime(),
    bar = el.div(),
    body = el("div#drawing.fill.scroll-page");
  const find = search("Only with", (text) => {
    only = text;
    draw();
  });
  root.append(panel("Blackboard", [find, button("Read again", () => read())], bar, body));

  const read = life.reader(
    async () => {
      const asked = which,
        answer = await get(GRAPHS[asked].path);
      if (asked !== which) return;
      dot = answer.dotgraph;
      problem = "";
      draw();
    },
    SOON_MS,
    (error) => {
      problem = error.message;
      draw();
    },
  );
  function draw() {
    const { title, empty } = GRAPHS[which];
    if (app.recording || problem || dot)
      redraw(body, [which, dot, problem, only], () =>
        app.recording || problem
          ? none(problem || "Not in a recording")
          : [el.h3(title), drawGraph(dot, title, { only, empty, href })],
      );
  }
  life.add(app.onRenew(read));
  life.every(AGAIN_MS, () => app.recording || app.connection !== "open" || read());
  return {
    go([name]) {
      if (name !== which) dot = problem = "";
      which = Object.hasOwn(GRAPHS, name) ? name : "graph";
      refill(bar, blackboardTabs("#/blackboard/" + which));
      if (!app.recording) read();
      draw();
    },
    close: life.close,
  };
}
