// Wheel, pointer, touch and keys of the timeline.
import { gestures } from "cx/canvas.js";

const STEP = 0.15, // a key pans by this share of the width
  ZOOM_IN = 0.6; // a key zooms by this factor of the visible time

/** Listen to the pointer. @param surface the node of the timeline's canvas */
export function pointerInput(surface, timeline) {
  const { timeWindow } = timeline;
  gestures(surface, {
    pan(dx, dy) {
      if (dx) timeWindow.pan(-dx);
      timeline.scrollBy(-dy);
    },
    zoom: (factor, x) => timeWindow.zoom(1 / factor, x),
    point: (x, y) => timeline.hover([x, y]),
    leave: () => timeline.hover(null),
    press: (x, y) => timeline.clickAt(x, y),
    /** A press on the axis chooses the moment. */
    grab(x, y) {
      const choose = (at) => timeline.setCursorAt(at);
      if (!timeline.isAxis(y)) return null;
      choose(x);
      return choose;
    },
  });
  surface.addEventListener("dblclick", ({ offsetX }) => timeline.zoomAt(offsetX));
}

/** The keys of the timeline; the tree of names has further keys. */
export function keyInput(box, timeline) {
  const { timeWindow } = timeline,
    zoom = (factor) => timeWindow.zoom(factor, timeline.cursorX),
    pan = (share) => timeWindow.pan(share * timeWindow.width);
  const actions = {
    "+": () => zoom(ZOOM_IN),
    "=": () => zoom(ZOOM_IN), // the key of + without Shift
    "-": () => zoom(1 / ZOOM_IN),
    w: () => zoom(ZOOM_IN),
    s: () => zoom(1 / ZOOM_IN),
    a: () => pan(-STEP),
    d: () => pan(STEP),
    0: () => timeWindow.fit(),
    f: () => timeline.zoomToSelection(),
    n: () => timeline.toNow(),
    e: () => timeline.toError(1),
    E: () => timeline.toError(-1),
    Backspace: () => timeline.up(),
  };
  const shifted = { ArrowLeft: () => pan(-STEP), ArrowRight: () => pan(STEP) };
  const press = (event) => {
    const action = (event.shiftKey && shifted[event.key]) || actions[event.key],
      isTyped = event.target.closest("input, select, textarea") && event.target.type !== "checkbox";
    if (event.ctrlKey || event.metaKey || event.altKey || isTyped || !action) return;
    action();
    event.preventDefault();
    event.stopPropagation();
  };
  box.addEventListener("keydown", press, true); // before the tree of names, which has the arrow keys, too
}
