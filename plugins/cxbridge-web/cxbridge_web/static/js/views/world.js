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

export const tab = { title: "World", order: 57, formerly: "map" }; // old addresses still open the view
export const moment = "past";
export const kinds = ["interface", "navgraph", "fact"];
const SOON_MS = 1000, // the shortest time between two requests
  TICK_MS = 250, // the period of drawing a live run
  MOST_CHANGES = 40; // of facts
// the frame of the map and the choices outlive the view
let frame = "";
const isShown = { trails: true, frames: true };

/** The text of metres, to the centimetre. */
const metresText = (value) => value.toFixed(2);
const placeText = ({ x, y }) => metresText(x) + ", " + metresText(y) + " m";
/** The text about an item of the map. */
function describe({ name, kind, properties = {}, ...place }) {
  const more = kind === "node" ? Object.entries(properties).map((pair) => pair.join(" ")) : [];
  return [name + ": " + placeText(place), ...more].join("; ");
}

export function open(root, app) {
  const life = new Lifetime(),
    store = tracksOf(app),
    changes = changesOf(app),
    { recording } = app;
  let isMoved = false, // the user has moved the map, which then is not fitted any more
    fittedSign = "", // identifies the items to which the map was fitted
    chosenName = "", // the name of an item
    shownItems = []; // the items of the map and its table
  const hoverLine = el("p#map-told.dim.small", { role: "status" });
  const drawing = new Drawing({
    hover(item) {
      hoverLine.textContent = item ? describe(item) : "";
    },
    pick(item) {
      chosenName = item ? item.name : "";
      draw();
    },
    moved() {
      isMoved = true;
    },
  });
  const frameChoice = choice({ "aria-label": "frame of the map", id: "map-frame" }, (name) => {
    frame = name;
    isMoved = false;
    draw();
  });
  const lanes = new Lanes((time) => app.select({ time })),
    robotsBox = el("div#robots"),
    factsBox = el("div#changed-facts", { tabindex: "0", role: "region", "aria-label": "facts that changed" }),
    tableBox = el("div#map-items.map-table"),
    mapBox = el("div.world-map", drawing.box, tableBox, hoverLine),
    side = el("div.map-side", robotsBox, el.h3("Facts that changed"), factsBox),
    body = el("div.map-body", mapBox, side);
  const toggle = (name) =>
    checkbox(name, isShown[name], (on) => {
      isShown[name] = on;
      draw();
    });
  const showAll = () => {
    isMoved = false;
    drawing.fit();
  };
  const mapTools = el(
    "span.tools",
    frameChoice,
    toggle("trails"),
    toggle("frames"),
    button("−", () => drawing.zoom(1 / 1.5), { "aria-label": "zoom out" }),
    button("+", () => drawing.zoom(1.5), { "aria-label": "zoom in" }),
    button("All", showAll, { title: "show everything (0)" }),
  );
  root.append(panel("World", [mapTools], lanes.box, body));
  const showError = (error) => app.toast(error.message, true),
    read = life.reader(() => store.read(), SOON_MS, showError);

  function draw() {
    const { history, step } = app.model,
      callsByRobot = robotsOf(history),
      shownMoment = recording
        ? { time: recording.time, step }
        : { time: app.selection.value.time ?? app.now, step: history.steps },
      from = recording ? recording.begin : (app.zero ?? history.begin ?? shownMoment.time),
      to = recording ? recording.end : Math.max(app.now, from + 1),
      latestChanges = changes.latest(MOST_CHANGES, draw);
    lanes.box.hidden = !callsByRobot.size;
    lanes.draw(callsByRobot, history, { from, to, shown: shownMoment.time });
    drawMap(callsByRobot, shownMoment);
    const noRobot = () =>
      none("No robot has done anything yet", "A robot appears with its first skill call.");
    refill(
      robotsBox,
      callsByRobot.size
        ? robotCards(callsByRobot, shownMoment, { placeOf, changes: latestChanges })
        : noRobot(),
    );
    drawFacts(latestChanges);
  }
  /** The robot in the name of a track, else the only robot of a run with one pose; "" without a robot. */
  function robotOf(track, callsByRobot) {
    const names = [...callsByRobot.keys()],
      named = names.find((name) => track.name.toLowerCase().includes(name.toLowerCase())),
      isOnly = track.kind !== "frame" && names.length === 1 && store.tracks.poses.size === 1;
    return named || (isOnly ? names[0] : "");
  }
  /** The place of a robot in words; "" for a robot that is not on the map. */
  const placeOf = (name) => {
    const item = shownItems.find((each) => each.robot === name && each.x !== null);
    return item ? placeText(item) : "";
  };
  /** The label of an item on the map: its name, and the running skill of a robot. */
  function labelOf(track, robot, callsByRobot, { step }) {
    const call = robot && callAt(callsByRobot.get(robot), step),
      name = robot && callsByRobot.size > 1 ? robot : track.name;
    return call && !isOver(call, step) ? name + " · " + call.text.split(": ", 1)[0] : name;
  }

  function drawMap(callsByRobot, shownMoment) {
    const { tracks } = store,
      graphs = [...tracks.graphs].map(([name, graph]) => ({ name, ...graph })),
      hasMap = graphs.length > 0 || tracks.poses.size > 0 || tracks.frames.size > 0,
      time = recording ? recording.time : (app.selection.value.time ?? Infinity);
    mapBox.hidden = mapTools.hidden = !hasMap;
    body.classList.toggle("without-map", !hasMap);
    shownItems = [];
    if (!hasMap) return;
    const names = tracks.frameNames();
    if (!names.includes(frame)) frame = names[0] || "map";
    frameChoice.hidden = names.length < 2;
    frameChoice.offer(names, frame);
    const itemOf = ({ track, ...place }, number) => {
      const { name, kind } = track,
        robot = robotOf(track, callsByRobot),
        label = labelOf(track, robot, callsByRobot, shownMoment),
        trail = isShown.trails && place.x !== null ? tracks.trail(track, frame, time) : [],
        look = { colourNumber: number % SERIES_COLOURS, isMarked: name === chosenName };
      return { ...place, name, kind, robot, label, trail, ...look };
    };
    shownItems = tracks
      .placed(frame, time)
      .filter(({ track }) => isShown.frames || track.kind !== "frame")
      .map(itemOf);
    const items = shownItems.filter((item) => item.x !== null);
    drawing.show(graphs, items);
    const sign = JSON.stringify([frame, graphs.map(({ name }) => name), items.map(({ name }) => name)]);
    if (!isMoved && sign !== fittedSign && drawing.fit()) fittedSign = sign;
    drawTable();
  }

  function drawFacts(list) {
    const factItem = ({ time, before, after }) =>
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
    redraw(factsBox, list, () =>
      list.length ? el("ol.changes", list.map(factItem)) : none("No fact has changed", hint),
    );
  }
  function drawTable() {
    const state = shownItems.map(({ label, x, y, yaw, frame: itemFrame, isMarked }) => [
      label,
      x,
      y,
      yaw,
      itemFrame,
      isMarked,
    ]);
    redraw(tableBox, state, () =>
      shownItems.length
        ? dataTable({}, ["", "x, m", "y, m", "turn"], shownItems.map(tableRow))
        : note("No robot is here at this moment."),
    );
  }
  function tableRow({ name, x, y, yaw, isMarked, colourNumber, frame: itemFrame }) {
    const choose = () => {
      chosenName = name;
      if (x !== null) drawing.centre(x, y);
      draw();
    };
    const turn = yaw === null ? "" : Math.round((yaw * 180) / Math.PI) + "°",
      key = el.span({ class: "plot-key series-" + (colourNumber + 1), "aria-hidden": "true" });
    return el.tr(
      { class: isMarked ? "marked" : null, "data-item": name },
      el.th({ scope: "row" }, key, " ", button(name, choose, { class: "quiet" })),
      x === null
        ? el("td.dim.small", { colspan: 3 }, "in " + itemFrame + ", not connected to " + frame)
        : [metresText(x), metresText(y), turn].map((text) => el("td.n", text)),
    );
  }

  const drawSoon = life.framed(draw);
  life.add(store.onChange(drawSoon), app.model.onChange(drawSoon), app.onRenew(read), () => drawing.gone());
  life.listen(app, "select", drawSoon);
  if (recording) {
    life.follow(recording, drawSoon);
  } else {
    life.every(TICK_MS, drawSoon);
    read();
  }
  return { go: draw, close: life.close };
}
