// Robots and world at a moment: the robots' skill calls over time, the map (robots with trails, navigation
// graph, coordinate frames), the state of each robot, and the facts that changed.
import { SERIES_COLOURS } from "cx/canvas.js";
import {
  button,
  checkbox,
  choice,
  clockText,
  dataTable,
  el,
  none,
  note,
  panel,
  redraw,
  refill,
} from "cx/dom.js";
import { linked } from "cx/links.js";
import { Drawing } from "cx/map/drawing.js";
import { tracksOf } from "cx/map/store.js";
import { Lifetime } from "cx/scaffold.js";
import { changesOf } from "cx/world/changes.js";
import { callAt, isOver, Lanes, robotCards, robotsOf } from "cx/world/robots.js";

export const tab = { title: "World", order: 57, formerly: "map" };
export const moment = "past";
export const kinds = ["interface", "navgraph", "fact"];
const SOON_MS = 1000,
  TICK_MS = 250,
  MOST_CHANGES = 40;
let frame = ""; // frame and choices stay while other views are open
const shows = { trails: true, frames: true };

const number = (value) => value.toFixed(2);
const placeText = ({ x, y }) => number(x) + ", " + number(y) + " m";
function describe({ name, kind, properties = {}, ...place }) {
  const more = kind === "node" ? Object.entries(properties).map((pair) => pair.join(" ")) : [];
  return [name + ": " + placeText(place), ...more].join("; ");
}

export function open(root, app) {
  const life = new Lifetime(),
    store = tracksOf(app),
    changes = changesOf(app),
    { recording } = app;
  let moved = false, // by hand, so that the map stays
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
  const select = choice({ "aria-label": "frame of the map", id: "map-frame" }, (name) => {
    frame = name;
    moved = false;
    draw();
  });
  const lanes = new Lanes((time) => app.select({ time })),
    robots = el("div#robots"),
    facts = el("div#changed-facts", { tabindex: "0", role: "region", "aria-label": "facts that changed" }),
    table = el("div#map-items.map-table"),
    map = el("div.world-map", drawing.box, table, where),
    side = el("div.map-side", robots, el.h3("Facts that changed"), facts),
    body = el("div.map-body", map, side);
  const toggle = (name) =>
    checkbox(name, shows[name], (on) => {
      shows[name] = on;
      draw();
    });
  const showAll = () => {
    moved = false;
    drawing.fit();
  };
  const mapTools = el(
    "span.tools",
    select,
    toggle("trails"),
    toggle("frames"),
    button("−", () => drawing.zoom(1 / 1.5), { "aria-label": "zoom out" }),
    button("+", () => drawing.zoom(1.5), { "aria-label": "zoom in" }),
    button("All", showAll, { title: "show everything (0)" }),
  );
  root.append(panel("World", [mapTools], lanes.box, body));
  const failed = (error) => app.toast(error.message, true),
    read = life.reader(() => store.read(), SOON_MS, failed);

  function draw() {
    const { history, step } = app.model,
      found = robotsOf(history),
      at = recording
        ? { time: recording.time, step }
        : { time: app.selection.value.time ?? app.now, step: history.steps },
      from = recording ? recording.begin : (app.zero ?? history.begin ?? at.time),
      to = recording ? recording.end : Math.max(app.now, from + 1),
      known = changes.latest(MOST_CHANGES, draw);
    lanes.box.hidden = !found.size;
    lanes.draw(found, history, { from, to, now: at.time });
    drawMap(found, at);
    const nobody = () => none("No robot has done anything yet", "A robot appears with its first skill call.");
    refill(robots, found.size ? robotCards(found, at, { placeOf, known }) : nobody());
    drawFacts(known);
  }
  /** The robot of a track: the track has the robot's name, or the run has one robot and one pose. */
  function robotOf(track, found) {
    const names = [...found.keys()],
      named = names.find((name) => track.name.toLowerCase().includes(name.toLowerCase())),
      isOnly = track.kind !== "frame" && names.length === 1 && store.tracks.poses.size === 1;
    return named || (isOnly ? names[0] : "");
  }
  const placeOf = (name) => {
    const item = shown.find((each) => each.robot === name && each.x !== null);
    return item ? placeText(item) : "";
  };
  function labelOf(track, robot, found, { step }) {
    const call = robot && callAt(found.get(robot), step),
      name = robot && found.size > 1 ? robot : track.name;
    return call && !isOver(call, step) ? name + " · " + call.text.split(": ", 1)[0] : name;
  }

  function drawMap(found, at) {
    const { tracks } = store,
      graphs = [...tracks.graphs].map(([name, graph]) => ({ name, ...graph })),
      has = graphs.length > 0 || tracks.poses.size > 0 || tracks.frames.size > 0,
      time = recording ? recording.time : (app.selection.value.time ?? Infinity);
    map.hidden = mapTools.hidden = !has;
    body.classList.toggle("without-map", !has);
    shown = [];
    if (!has) return;
    const names = tracks.frameNames();
    if (!names.includes(frame)) frame = names[0] || "map";
    select.hidden = names.length < 2;
    select.offer(names, frame);
    const itemOf = ({ track, ...place }, number) => {
      const { name, kind } = track,
        robot = robotOf(track, found),
        label = labelOf(track, robot, found, at),
        trail = shows.trails && place.x !== null ? tracks.trail(track, frame, time) : [],
        look = { number: number % SERIES_COLOURS, marked: name === chosen };
      return { ...place, name, kind, robot, label, trail, ...look };
    };
    shown = tracks
      .placed(frame, time)
      .filter(({ track }) => shows.frames || track.kind !== "frame")
      .map(itemOf);
    const items = shown.filter((item) => item.x !== null);
    drawing.show(graphs, items);
    const sign = JSON.stringify([frame, graphs.map(({ name }) => name), items.map(({ name }) => name)]);
    if (!moved && sign !== fitted && drawing.fit()) fitted = sign;
    drawTable();
  }

  function drawFacts(list) {
    const item = ({ time, before, after }) =>
      el.li(
        el("span.dim.n", clockText(time, 3)),
        " ",
        before && el.del(linked(app, before)),
        before && after && " → ",
        after && linked(app, after),
      );
    const hint =
      recording && !recording.isPast
        ? "Recordings have facts with --trace-level facts."
        : "The page collects them while this view is open.";
    redraw(facts, list, () =>
      list.length ? el("ol.changes", list.map(item)) : none("No fact has changed", hint),
    );
  }
  function drawTable() {
    const state = shown.map(({ label, x, y, yaw, frame: of, marked }) => [label, x, y, yaw, of, marked]);
    redraw(table, state, () =>
      shown.length
        ? dataTable({}, ["", "x, m", "y, m", "turn"], shown.map(tableRow))
        : note("No robot is here at this moment."),
    );
  }
  function tableRow({ name, x, y, yaw, marked, number: colour, frame: of }) {
    const choose = () => {
      chosen = name;
      if (x !== null) drawing.centre(x, y);
      draw();
    };
    const turn = yaw === null ? "" : Math.round((yaw * 180) / Math.PI) + "°",
      key = el.span({ class: "plot-key series-" + (colour + 1), "aria-hidden": "true" });
    return el.tr(
      { class: marked ? "marked" : null, "data-item": name },
      el.th({ scope: "row" }, key, " ", button(name, choose, { class: "quiet" })),
      x === null
        ? el("td.dim.small", { colspan: 3 }, "in " + of + ", not connected to " + frame)
        : [number(x), number(y), turn].map((text) => el("td.n", text)),
    );
  }

  const soon = life.framed(draw);
  life.add(store.onChange(soon), app.model.onChange(soon), app.onRenew(read), () => drawing.gone());
  life.listen(app, "select", soon);
  if (recording) {
    life.follow(recording, soon);
  } else {
    life.every(TICK_MS, soon);
    read();
  }
  return { go: draw, close: life.close };
}
