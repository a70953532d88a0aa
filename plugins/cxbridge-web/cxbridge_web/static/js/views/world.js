// Robots, plan and world together at one moment: the robots' skill calls over time, the map with robots and their
// trails (the navigation graph, coordinate frames), how each robot stands, and the facts that changed.
import { throttled } from "cx/api.js";
import { SERIES_COLOURS, save } from "cx/canvas.js";
import { button, checkbox, clockText, dataTable, el, none, panel, refill } from "cx/dom.js";
import { linked } from "cx/links.js";
import { Drawing } from "cx/map/drawing.js";
import { tracksOf } from "cx/map/store.js";
import { changesOf } from "cx/world/changes.js";
import { callAt, isOver, Lanes, robotCards, robotsOf } from "cx/world/robots.js";

export const tab = { title: "World", order: 57, formerly: "map" };
export const moment = "past";
export const kinds = ["interface", "navgraph", "fact"];
const SOON_MS = 1000,
  TICK_MS = 250,
  MOST_CHANGES = 40;
let frame = "",
  showsFrames = true,
  showsTrails = true; // stay when another view was open

export function open(root, app) {
  const store = tracksOf(app),
    changes = changesOf(app);
  let moved = false, // by hand: it stays where it is
    fitted = "",
    chosen = "",
    shown = [];
  const where = el("p#map-told.dim.small", { role: "status" });
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
  const choice = el("select#map-frame", { "aria-label": "frame that the map is drawn in" });
  choice.addEventListener("change", () => {
    frame = choice.value;
    moved = false;
    draw();
  });
  const lanes = new Lanes((chosenTime) => app.select({ time: chosenTime }));
  const robots = el("div#robots"),
    facts = el("div#changed-facts", { tabindex: "0", role: "region", "aria-label": "facts that changed" });
  const table = el("div#map-items.map-table");
  const map = el("div.world-map", drawing.box, table, where);
  const body = el("div.map-body", map, el("div.map-side", robots, el.h3("Facts that changed"), facts));
  const mapTools = el("span.tools", [
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
  ]);
  root.append(panel("World", [mapTools], lanes.box, body));
  const read = throttled(
    async () => {
      await store.read();
    },
    SOON_MS,
    (error) => app.toast(error.message, true),
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
  function now() {
    const { model, recording } = app;
    return recording
      ? { time: recording.time, step: model.step }
      : { time: app.selection.value.time ?? app.now, step: model.history.steps };
  }

  function draw() {
    const { history } = app.model,
      found = robotsOf(history),
      at = now(),
      { recording } = app,
      from = recording ? recording.begin : (app.zero ?? history.begin ?? at.time),
      known = changes.latest(MOST_CHANGES, draw);
    lanes.box.hidden = !found.size;
    lanes.draw(found, history, {
      from,
      to: recording ? recording.end : Math.max(app.now, from + 1),
      now: at.time,
    });
    drawMap(found, at);
    refill(
      robots,
      ...(found.size
        ? robotCards(found, at, { placeOf, known })
        : [none("No robot has done anything yet", "Robots are here from their first skill call on.")]),
    );
    drawFacts(known);
  }
  /** The robot whose pose a track is: the robot's name is in that of the track, or there is one of each. */
  function robotOf(track, found) {
    const named = [...found.keys()].find((name) => track.name.toLowerCase().includes(name.toLowerCase()));
    if (named || track.kind === "frame") return named || "";
    return found.size === 1 && store.tracks.poses.size === 1 ? [...found.keys()][0] : "";
  }
  const placeOf = (name) => {
    const item = shown.find((each) => each.robot === name && each.x !== null);
    return item ? number(item.x) + ", " + number(item.y) + " m" : "";
  };
  function labelOf(track, found, { step }) {
    const robot = robotOf(track, found);
    if (!robot) return track.name;
    const call = callAt(found.get(robot), step),
      name = found.size === 1 ? track.name : robot;
    return call && !isOver(call, step) ? name + " · " + call.text.split(": ", 1)[0] : name;
  }

  function drawMap(found, at) {
    const { tracks } = store,
      graphs = [...tracks.graphs].map(([name, graph]) => ({ name, ...graph })),
      has = graphs.length > 0 || tracks.poses.size > 0 || tracks.frames.size > 0;
    map.hidden = mapTools.hidden = !has;
    body.classList.toggle("without-map", !has);
    shown = [];
    if (!has) return;
    const names = tracks.frameNames();
    if (!names.includes(frame)) frame = names[0] || "map";
    drawChoice(names);
    shown = tracks
      .placed(frame, time())
      .filter((item) => showsFrames || item.track.kind !== "frame")
      .map((item, place) => ({
        ...item,
        name: item.track.name,
        label: labelOf(item.track, found, at),
        robot: robotOf(item.track, found),
        kind: item.track.kind,
        number: place % SERIES_COLOURS,
        marked: item.track.name === chosen,
        trail: showsTrails && item.x !== null ? tracks.trail(item.track, frame, time()) : [],
      }));
    const items = shown.filter((item) => item.x !== null);
    drawing.show(graphs, items);
    const sign = JSON.stringify([frame, graphs.map(({ name }) => name), items.map(({ name }) => name)]);
    if (!moved && sign !== fitted && drawing.fit()) fitted = sign;
    drawTable();
  }

  let drawnFacts = "";
  function drawFacts(list) {
    const sign = JSON.stringify(list.map((each) => [each.time, each.before, each.after]));
    if (sign === drawnFacts && facts.firstChild) return;
    drawnFacts = sign;
    const rows = list.map((change) =>
      el.li(
        el("span.dim.n", clockText(change.time, 3)),
        " ",
        change.before ? el.del(linked(app, change.before)) : null,
        change.before && change.after ? " → " : null,
        change.after ? linked(app, change.after) : null,
      ),
    );
    const hint =
      app.recording && !app.recording.isPast
        ? "They are in recordings of --trace-level facts."
        : "They are here from when this view was opened.";
    refill(facts, rows.length ? el("ol.changes", rows) : none("No fact has changed", hint));
  }
  let drawnChoice = "";
  function drawChoice(names) {
    const sign = [...names, "", frame].join("\n");
    choice.hidden = names.length < 2;
    if (sign === drawnChoice) return;
    drawnChoice = sign;
    choice.replaceChildren(
      ...names.map((name) => el.option({ value: name, selected: name === frame }, name)),
    );
  }
  let drawnTable = "";
  function drawTable() {
    const sign = JSON.stringify(
      shown.map((item) => [item.label, item.x, item.y, item.yaw, item.frame, item.marked]),
    );
    if (sign === drawnTable) return;
    drawnTable = sign;
    const rows = shown.map((item) =>
      el.tr(
        { class: item.marked ? "marked" : null, "data-item": item.name },
        el.th(
          { scope: "row" },
          el.span({ class: "plot-key series-" + (item.number + 1), "aria-hidden": "true" }),
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
          ? el("td.dim.small", { colspan: 3 }, "in " + item.frame + ", not connected to " + frame)
          : [
              el("td.n", number(item.x)),
              el("td.n", number(item.y)),
              el("td.n", item.yaw === null ? "" : Math.round((item.yaw * 180) / Math.PI) + "°"),
            ],
      ),
    );
    refill(
      table,
      rows.length
        ? dataTable({}, ["", "x, m", "y, m", "turn"], rows)
        : el("p.dim", "No robot is here at this moment."),
    );
  }

  let waiting = 0;
  const soon = () => {
    waiting ||= requestAnimationFrame(() => {
      waiting = 0;
      draw();
    });
  };
  const stops = [store.onChange(soon), app.model.onChange(soon)],
    tick = setInterval(() => {
      if (!app.recording && !document.hidden) soon();
    }, TICK_MS);
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
      for (const stop of stops) stop();
      clearInterval(tick);
      renewed();
      read.stop();
      app.removeEventListener("select", soon);
      if (listened) listened.listeners.delete(soon);
      cancelAnimationFrame(waiting);
      drawing.gone();
    },
  };
}
