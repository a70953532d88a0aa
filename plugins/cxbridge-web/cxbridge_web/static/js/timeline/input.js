// Wheel, pointer, touch and keys of the timeline.
const STEP = 0.15, // of the width: how far a key pans
  SLOP = 4; // pixels: less than that is a click

/**
 * @param surface the canvas
 * @param component the timeline
 */
export function pointerInput(surface, component) {
  const { window } = component,
    pointers = new Map();
  let press = null,
    pinch = null;
  const place = (event) => {
    const box = surface.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  surface.addEventListener(
    "wheel",
    (event) => {
      const scale = event.deltaMode === 1 ? 16 : 1;
      if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY))
        window.pan((event.deltaX || event.deltaY) * scale);
      else window.zoom(Math.exp((event.deltaY * scale) / (event.ctrlKey ? 120 : 500)), place(event)[0]);
      event.preventDefault();
    },
    { passive: false },
  );
  surface.addEventListener("pointerdown", (event) => {
    if (event.button > 0) return;
    surface.setPointerCapture(event.pointerId);
    const [x, y] = place(event);
    pointers.set(event.pointerId, [x, y]);
    component.hover(null);
    press = { x, y, isDrag: false, onAxis: component.isAxis(y) };
    if (press.onAxis) component.setCursorAt(x);
    if (pointers.size === 2) {
      const [[a], [b]] = [...pointers.values()];
      pinch = { a: window.value(a), b: window.value(b) };
      press.isDrag = true;
    }
  });
  surface.addEventListener("pointermove", (event) => {
    const [x, y] = place(event);
    if (!pointers.has(event.pointerId)) {
      if (event.pointerType !== "touch") component.hover([x, y]);
      return;
    }
    const [beforeX, beforeY] = pointers.get(event.pointerId);
    pointers.set(event.pointerId, [x, y]);
    if (pinch && pointers.size === 2) {
      const [[a], [b]] = [...pointers.values()];
      if (Math.abs(a - b) > 10) {
        const span = ((pinch.b - pinch.a) / (b - a)) * window.width,
          from = pinch.a - (a / window.width) * span;
        if (span > 0) window.set(from, from + span);
      }
      return;
    }
    if (!press) return;
    if (press.onAxis) component.setCursorAt(x);
    else {
      press.isDrag ||= Math.hypot(x - press.x, y - press.y) > SLOP;
      if (!press.isDrag) return;
      if (x !== beforeX) window.pan(beforeX - x);
      component.scrollBy(beforeY - y);
    }
  });
  const release = (event) => {
    if (!pointers.delete(event.pointerId)) return;
    if (pointers.size < 2) pinch = null;
    if (press && !press.isDrag && !press.onAxis && event.type === "pointerup")
      component.clickAt(...place(event));
    if (!pointers.size) press = null;
  };
  surface.addEventListener("pointerup", release);
  surface.addEventListener("pointercancel", release);
  surface.addEventListener("pointerleave", () => component.hover(null));
  surface.addEventListener("dblclick", (event) => component.zoomAt(...place(event)));
}

/** Keys of the component, besides those with which the tree of names is walked. */
export function keyInput(box, component) {
  const { window } = component;
  const pan = (part) => window.pan(part * window.width);
  const actions = {
    "+": () => window.zoom(0.6, component.cursorX),
    "=": () => window.zoom(0.6, component.cursorX),
    "-": () => window.zoom(1 / 0.6, component.cursorX),
    w: () => window.zoom(0.6, component.cursorX),
    s: () => window.zoom(1 / 0.6, component.cursorX),
    a: () => pan(-STEP),
    d: () => pan(STEP),
    0: () => window.fit(),
    f: () => component.zoomToSelection(),
    n: () => component.toNow(),
    e: () => component.toError(1),
    E: () => component.toError(-1),
    Backspace: () => component.up(),
  };
  const shifted = { ArrowLeft: () => pan(-STEP), ArrowRight: () => pan(STEP) };
  box.addEventListener(
    "keydown",
    (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.target.closest("input, select, textarea") && event.target.type !== "checkbox") return;
      const action = event.shiftKey && shifted[event.key] ? shifted[event.key] : actions[event.key];
      if (!action) return;
      action();
      event.preventDefault();
      event.stopPropagation();
    },
    true,
  );
}
