// A canvas that fills its box on screens of any density, drawn once a frame, in the page's colours; lines and
// dots; moving and scaling by wheel, drag and two fingers.
import { el } from "cx/dom.js";
import { NAMES, OUTCOMES } from "cx/outcome.js";

export const SERIES_COLOURS = 8;
const FONT = "12px system-ui, sans-serif";
const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3]];
export const dashOf = (number) => DASHES[number % DASHES.length];

/** Round steps for a grid: 1, 2 or 5 times a power of ten, about `count` of them. */
export function niceStep(span, count) {
  const rough = span / Math.max(1, count);
  if (!(rough > 0) || !Number.isFinite(rough)) return 1;
  const power = 10 ** Math.floor(Math.log10(rough)),
    times = rough / power;
  return power * (times < 1.5 ? 1 : times < 3.5 ? 2 : times < 7.5 ? 5 : 10);
}

let colours = null; // until the theme changes
/** The colours of the page as they are now. */
export function palette() {
  if (colours) return colours;
  const probe = el.span({ hidden: true });
  document.body.append(probe);
  const of = (name) => {
    probe.style.color = `var(--${name})`;
    return getComputedStyle(probe).color;
  };
  const outcomeOf = (name) => ({
    fill: of(`outcome-${name}`),
    edge: of(`outcome-${name}-edge`),
    ink: of(`outcome-${name}-ink`),
    icon: OUTCOMES[name].icon,
  });
  colours = {
    ...Object.fromEntries(["text", "dim", "line", "focus", "panel"].map((name) => [name, of(name)])),
    back: of("card, var(--back)"),
    loud: of("outcome-failed-edge"),
    outcomes: Object.fromEntries(NAMES.map((name) => [name, outcomeOf(name)])),
    series: Array.from({ length: SERIES_COLOURS }, (_, at) => of("series-" + (at + 1))),
  };
  probe.remove();
  return colours;
}

export class Canvas {
  /** @param paint(context, width, height, colours) draws all of it */
  constructor(paint, attributes = {}) {
    this.paint = paint;
    this.node = el.canvas({ "aria-hidden": "true", ...attributes });
    this.context = this.node.getContext("2d");
    this.frame = 0;
    this.sizes = new ResizeObserver(() => this.later());
    this.sizes.observe(this.node);
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.changed = () => {
      colours = null;
      this.later();
    };
    this.dark.addEventListener("change", this.changed);
    this.looks = new MutationObserver(this.changed); // the page's own switch for light and dark
    this.looks.observe(document.documentElement, { attributes: true });
  }

  get width() {
    return this.node.clientWidth;
  }
  get height() {
    return this.node.clientHeight;
  }

  later() {
    this.frame ||= requestAnimationFrame(() => {
      this.frame = 0;
      this.draw();
    });
  }

  draw() {
    const { width, height, node, context } = this,
      density = Math.min(window.devicePixelRatio || 1, 3);
    if (!width || !height) return;
    const size = [Math.round(width * density), Math.round(height * density)];
    if (node.width !== size[0]) [node.width] = size;
    if (node.height !== size[1]) [, node.height] = size;
    context.setTransform(density, 0, 0, density, 0, 0);
    context.font = FONT;
    this.paint(context, width, height, palette());
  }

  gone() {
    cancelAnimationFrame(this.frame);
    this.sizes.disconnect();
    this.looks.disconnect();
    this.dark.removeEventListener("change", this.changed);
  }
}

/** Fill or stroke the path of a context. */
export function ink(context, { fill, stroke, width = 1, dash = [], alpha = 1 }) {
  context.globalAlpha = alpha;
  if (fill) {
    context.fillStyle = fill;
    context.fill();
  }
  if (stroke) {
    context.strokeStyle = stroke;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.stroke();
    context.setLineDash([]);
  }
  context.globalAlpha = 1;
}
/** A line through points [x, y], or the shape between them. @param look see ink */
export function line(context, points, look) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
  if (look.fill) context.closePath();
  ink(context, look);
}
export function dot(context, x, y, radius, look) {
  context.beginPath();
  context.arc(x, y, radius, 0, 7);
  ink(context, look);
}
export function fillBox(context, colour, x, y, width, height, alpha = 1) {
  context.globalAlpha = alpha;
  context.fillStyle = colour;
  context.fillRect(x, y, width, height);
  context.globalAlpha = 1;
}

const SLOP = 4, // pixels: less than that is a click
  WHEEL = 500,
  PINCHED_WHEEL = 120; // browsers tell two fingers on a touchpad as a wheel with Ctrl
/**
 * Gestures on a node; what is moved and scaled the handlers say.
 * @param handlers.pan(dx, dy) in pixels; handlers.zoom(factor, x, y) around a point of the node;
 * handlers.point(x, y) the pointer rests there, handlers.leave(), handlers.press(x, y) a click that moved
 * nothing; handlers.grab(x, y), if it is there, may return a call that gets the places of this drag instead
 */
export function gestures(node, handlers) {
  const down = new Map(); // pointers that are pressed
  let moved = false,
    drag = null;
  const place = (event) => {
    const box = node.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  node.style.touchAction = "none";
  const wheel = (event) => {
    const { x, y } = place(event),
      lines = event.deltaMode === 1 ? 16 : 1,
      [dx, dy] = [event.deltaX * lines, event.deltaY * lines];
    event.preventDefault();
    if (event.shiftKey || Math.abs(dx) > Math.abs(dy)) handlers.pan(-(dx || dy), 0);
    else handlers.zoom(Math.exp(-dy / (event.ctrlKey ? PINCHED_WHEEL : WHEEL)), x, y);
  };
  node.addEventListener("wheel", wheel, { passive: false });
  node.addEventListener("pointerdown", (event) => {
    if (event.button > 0) return;
    const at = place(event);
    node.setPointerCapture(event.pointerId);
    down.set(event.pointerId, at);
    moved = down.size > 1;
    handlers.leave();
    drag = (down.size === 1 && handlers.grab?.(at.x, at.y)) || null;
  });
  node.addEventListener("pointermove", (event) => {
    const at = place(event),
      before = down.get(event.pointerId);
    if (!before) {
      if (event.pointerType !== "touch") handlers.point(at.x, at.y);
      return;
    }
    if (drag) drag(at.x, at.y);
    if (drag || (!moved && Math.hypot(at.x - before.x, at.y - before.y) <= SLOP)) return;
    moved = true;
    down.set(event.pointerId, at);
    const [, still] = [...down].find(([id]) => id !== event.pointerId) || [];
    const distance = (point) => Math.max(10, Math.hypot(point.x - still.x, point.y - still.y));
    if (!still) handlers.pan(at.x - before.x, at.y - before.y);
    else handlers.zoom(distance(at) / distance(before), (at.x + still.x) / 2, (at.y + still.y) / 2);
  });
  for (const end of ["pointerup", "pointercancel"])
    node.addEventListener(end, (event) => {
      const was = down.delete(event.pointerId),
        { x, y } = place(event);
      if (was && !moved && !drag && end === "pointerup") handlers.press(x, y);
      if (!down.size) drag = null;
    });
  node.addEventListener("pointerleave", () => handlers.leave());
}

/** Keys of a drawing: those of `actions` do not reach the page, whose numbers lead to other views. */
export function drawingKeys(box, actions) {
  box.addEventListener("keydown", (event) => {
    const action = actions[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey || !action) return;
    action(event);
    event.preventDefault();
    event.stopPropagation();
  });
}
