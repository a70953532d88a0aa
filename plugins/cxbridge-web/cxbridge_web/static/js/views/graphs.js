// Drawings of the blackboard (who writes and reads what) and of the coordinate frames, as Fawkes' webview
// has them.
import { get, throttled } from "cx/api.js";
import { button, el, none, panel, refill, search } from "cx/dom.js";
import { drawGraph } from "cx/graph/draw.js";
import { blackboardTabs } from "cx/views/blackboard.js";

export const parts = ["blackboard/graph", "blackboard/transforms"];
export const kinds = [];
const AGAIN_MS = 5000,
  SOON_MS = 500;
const GRAPHS = {
  graph: {
    title: "Who writes and reads what",
    path: "blackboard/graph",
    empty: "Nobody has opened an interface.",
    own: "#/blackboard/graph",
  },
  transforms: {
    title: "Coordinate frames",
    path: "transforms/graph",
    empty: "Nobody publishes transforms: no TransformInterface or Position3DInterface of a frame is there.",
    own: "#/blackboard/transforms",
  },
};

export function open(root, app) {
  let which = "graph",
    dot = "",
    drawn = null,
    problem = "",
    wanted = "";
  const bar = el.div(),
    body = el("div#drawing.fill.scroll-page");
  const find = search("Only with", (text) => {
    wanted = text;
    draw();
  });
  root.append(panel("Blackboard", [find, button("Read again", () => read())], bar, body));

  const read = throttled(
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
    const sign = [which, dot, problem, wanted].join("\n");
    if (sign === drawn) return;
    drawn = sign;
    const { title, empty } = GRAPHS[which];
    if (app.recording) refill(body, none("Not in a recording"));
    else if (problem) refill(body, none(problem));
    else if (dot)
      refill(
        body,
        el.h3(title),
        drawGraph(dot, title, {
          only: wanted,
          empty,
          href: (name) => (name.includes("::") ? "#/blackboard/" + encodeURIComponent(name) : ""),
        }),
      );
  }
  const renewed = app.onRenew(read);
  const again = setInterval(() => {
    if (!app.recording && !document.hidden && app.connection === "open") read();
  }, AGAIN_MS);
  return {
    go([name]) {
      if (name !== which) {
        dot = "";
        problem = "";
      }
      which = name in GRAPHS ? name : "graph";
      bar.replaceChildren(blackboardTabs(GRAPHS[which].own));
      if (!app.recording) read();
      draw();
    },
    close() {
      renewed();
      clearInterval(again);
      read.stop();
    },
  };
}
