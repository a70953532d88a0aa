// Moving and scaling of a drawing: wheel, drag, two fingers. What is moved is for the drawing to say.

const WHEEL = 0.0015;

/**
 * @param node where the gestures are made
 * @param handlers.pan(dx, dy) in pixels; handlers.zoom(factor, x, y) around a point of the node;
 * handlers.point(x, y) the pointer rests there, handlers.leave(), handlers.press(x, y) a click that moved nothing
 */
export function gestures(node, handlers) {
  const down = new Map(); // pointers that are pressed
  let moved = false;
  const place = (event) => {
    const box = node.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  node.style.touchAction = "none";
  node.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const { x, y } = place(event);
      if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY))
        handlers.pan(-(event.deltaX || event.deltaY), 0);
      else handlers.zoom(Math.exp(-event.deltaY * WHEEL), x, y);
    },
    { passive: false },
  );
  node.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    node.setPointerCapture(event.pointerId);
    down.set(event.pointerId, place(event));
    moved = false;
  });
  node.addEventListener("pointermove", (event) => {
    const at = place(event),
      before = down.get(event.pointerId);
    if (!before) {
      handlers.point(at.x, at.y);
      return;
    }
    if (Math.hypot(at.x - before.x, at.y - before.y) < 3 && !moved) return;
    moved = true;
    const other = [...down].find(([id]) => id !== event.pointerId);
    if (other) {
      const [, still] = other,
        distance = (point) => Math.max(10, Math.hypot(point.x - still.x, point.y - still.y));
      handlers.zoom(distance(at) / distance(before), (at.x + still.x) / 2, (at.y + still.y) / 2);
    } else handlers.pan(at.x - before.x, at.y - before.y);
    down.set(event.pointerId, at);
  });
  for (const end of ["pointerup", "pointercancel"])
    node.addEventListener(end, (event) => {
      const was = down.delete(event.pointerId),
        { x, y } = place(event);
      if (was && !moved && end === "pointerup") handlers.press(x, y);
    });
  node.addEventListener("pointerleave", () => handlers.leave());
}
