// The map: the navigation graph, coordinate frames, robots with their trails.
import { throttled } from "cx/api.js";
import { SERIES_COLOURS, save } from "cx/canvas.js";
import { button, checkbox, dataTable, el, none, panel, refill } from "cx/dom.js";
import { Drawing } from "cx/map/drawing.js";
import { tracksOf } from "cx/map/store.js";

export const tab = { title: "World", order: 15, formerly: "map" };
export const moment = "own";
export const kinds = ["interface", "navgraph"];
const SOON_MS = 1000;
const NO_PLACES =
  "A map needs a navigation graph, a Position3DInterface, a TransformInterface or a NavigatorInterface.";
let frame = "",
  showsFrames = true,
  showsTrails = true; // stay when another view was open

export function open(root, app) {
  const store = tracksOf(app);
  let moved = false, // by hand: it stays where it is
    fitted = "",
    problem = "",
    chosen = "",
    shown = [];
  const where = el("p", { class: "dim small", id: "map-told", role: "status" });
  const drawing = new Drawing({
    hover(found) {
      where.textContent = found ? describe(found) : "";
    },
    pick(found) {
      chosen = found ? found.name : "";
      draw();
    },
    moved() {
      moved = true;
    },
  });
  const choice = el("select", { "aria-label": "frame that the map is drawn in", id: "map-frame" });
  choice.addEventListener("change", () => {
    frame = choice.value;
    moved = false;
    draw();
  });
  const empty = el("div", { hidden: true });
  const table = el("div", { class: "map-table", id: "map-items" });
  const side = el("div", { class: "map-side" }, table, where);
  const body = el("div", { class: "map-body" }, drawing.box, side);
  root.append(
    panel(
      "Map",
      [
        choice,
        checkbox("trails", showsTrails, (wanted) => {
          showsTrails = wanted;
          draw();
        }),
        checkbox("frames", showsFrames, (wanted) => {
          showsFrames = wanted;
          draw();
        }),
        button("−", () => drawing.zoom(1 / 1.5), { "aria-label": "zoom out" }),
        button("+", () => drawing.zoom(1.5), { "aria-label": "zoom in" }),
        button("All", showAll, { title: "show everything (0)" }),
        button("PNG", async () => save(await drawing.canvas.picture(), "map.png")),
      ],
      empty,
      body,
    ),
  );
  const read = throttled(
    async () => {
      await store.read();
      problem = "";
    },
    SOON_MS,
    (error) => {
      problem = error.message;
      draw();
    },
  );

  function showAll() {
    moved = false;
    drawing.fit();
  }
  const number = (value) => value.toFixed(2);
  function describe(found) {
    const text = found.name + ": " + number(found.x) + ", " + number(found.y) + " m";
    if (found.kind !== "node") return text;
    const more = Object.entries(found.properties || {}).map((pair) => pair.join(" "));
    return [text, ...more].join("; ");
  }

  /** The moment that is shown. */
  function time() {
    if (app.recording) return app.recording.time;
    return app.selection.value.time ?? Infinity;
  }

  function draw() {
    const { tracks } = store,
      graphs = [...tracks.graphs].map(([name, graph]) => ({ name, ...graph })),
      has = graphs.length > 0 || tracks.poses.size > 0 || tracks.frames.size > 0;
    empty.hidden = has;
    body.hidden = !has;
    if (!has) {
      refill(empty, none(problem || "Nothing has a place yet", problem ? "" : NO_PLACES));
      return;
    }
    const names = tracks.frameNames();
    if (!names.includes(frame)) frame = names[0] || "map";
    drawChoice(names);
    shown = tracks
      .placed(frame, time())
      .filter((item) => showsFrames || item.track.kind !== "frame")
      .map((item, at) => ({
        ...item,
        name: item.track.name,
        kind: item.track.kind,
        number: at % SERIES_COLOURS,
        marked: item.track.name === chosen,
        trail: showsTrails && item.x !== null ? tracks.trail(item.track, frame, time()) : [],
      }));
    const items = shown.filter((item) => item.x !== null);
    drawing.show(graphs, items);
    const sign = JSON.stringify([frame, graphs.map(({ name }) => name), items.map(({ name }) => name)]);
    if (!moved && sign !== fitted && drawing.fit()) fitted = sign;
    drawTable();
  }
  let drawnChoice = "";
  function drawChoice(names) {
    const sign = [...names, "", frame].join("\n");
    choice.hidden = names.length < 2;
    if (sign === drawnChoice) return;
    drawnChoice = sign;
    choice.replaceChildren(
      ...names.map((name) => el("option", { value: name, selected: name === frame }, name)),
    );
  }
  let drawnTable = "";
  function drawTable() {
    const sign = JSON.stringify(
      shown.map((item) => [item.name, item.x, item.y, item.yaw, item.frame, item.marked]),
    );
    if (sign === drawnTable) return;
    drawnTable = sign;
    const rows = shown.map((item) =>
      el(
        "tr",
        { class: item.marked ? "marked" : null, "data-item": item.name },
        el(
          "th",
          { scope: "row" },
          el("span", { class: "plot-key series-" + (item.number + 1), "aria-hidden": "true" }),
          " ",
          button(
            item.name,
            () => {
              chosen = item.name;
              if (item.x !== null) drawing.centre(item.x, item.y);
              draw();
            },
            { class: "quiet" },
          ),
        ),
        item.x === null
          ? el("td", { class: "dim small", colspan: 3 }, "in " + item.frame + ", not connected to " + frame)
          : [
              el("td", { class: "n" }, number(item.x)),
              el("td", { class: "n" }, number(item.y)),
              el("td", { class: "n" }, item.yaw === null ? "" : Math.round((item.yaw * 180) / Math.PI) + "°"),
            ],
      ),
    );
    refill(
      table,
      rows.length
        ? dataTable({}, ["", "x, m", "y, m", "turn"], rows)
        : el("p", { class: "dim" }, "No robot is here at this moment."),
    );
  }

  let waiting = 0;
  const soon = () => {
    waiting ||= requestAnimationFrame(() => {
      waiting = 0;
      draw();
    });
  };
  const stop = store.onChange(soon);
  const renewed = app.onRenew(read);
  app.addEventListener("select", soon);
  const listened = app.recording;
  if (listened) listened.listeners.add(soon);
  if (!app.recording) read();
  return {
    go() {
      draw();
    },
    close() {
      stop();
      renewed();
      read.stop();
      app.removeEventListener("select", soon);
      if (listened) listened.listeners.delete(soon);
      cancelAnimationFrame(waiting);
      drawing.gone();
    },
  };
}
