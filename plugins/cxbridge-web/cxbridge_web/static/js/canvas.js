// A canvas that fills its box on screens of any pixel density, drawn at most once a frame, in the page's
// colours; lines and dots; gestures that move and scale a drawing: wheel, drag, two fingers.
import { el } from "cx/dom.js";
import { OUTCOME_NAMES, OUTCOMES } from "cx/outcome.js";

export const SERIES_COLOURS = 8;
const FONT = "12px system-ui, sans-serif";
// line patterns as setLineDash() takes them; they tell series apart without colours
const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3]];
export const dashOf = (number) => DASHES[number % DASHES.length];

/**
 * A round step of a grid, 1, 2 or 5 times a power of ten, that divides a span into about `count` parts; 1 for
 * a span without a positive, finite step.
 */
export function niceStep(span, count) {
  const exactStep = span / Math.max(1, count);
  if (!(exactStep > 0) || !Number.isFinite(exactStep)) return 1;
  const power = 10 ** Math.floor(Math.log10(exactStep)),
    factor = exactStep / power; // from 1 to 10; the limits lie between the round factors
  return power * (factor < 1.5 ? 1 : factor < 3.5 ? 2 : factor < 7.5 ? 5 : 10);
}

let colours = null; // the cached palette; null after a change of the theme
/** The colours of the page in its present theme. */
export function palette() {
  if (colours) return colours;
  // only an element in the page resolves a CSS variable to a colour that a canvas accepts
  const probe = el.span({ hidden: true });
  document.body.append(probe);
  const colourOf = (name) => {
    probe.style.color = `var(--${name})`;
    return getComputedStyle(probe).color;
  };
  const outcomeOf = (name) => ({
    fill: colourOf(`outcome-${name}`),
    edge: colourOf(`outcome-${name}-edge`),
    ink: colourOf(`outcome-${name}-ink`),
    icon: OUTCOMES[name].icon,
  });
  colours = {
    ...Object.fromEntries(["text", "dim", "line", "focus", "panel"].map((name) => [name, colourOf(name)])),
    back: colourOf("card, var(--back)"), // --back is the fallback of var()
    loud: colourOf("outcome-failed-edge"),
    outcomes: Object.fromEntries(OUTCOME_NAMES.map((name) => [name, outcomeOf(name)])),
    series: Array.from({ length: SERIES_COLOURS }, (_, at) => colourOf("series-" + (at + 1))),
  };
  probe.remove();
  return colours;
}

export class Canvas {
  /** @param paint(context, width, height, colours) draws the whole canvas; sizes in CSS pixels */
  constructor(paint, attributes = {}) {
    this.paint = paint;
    this.node = el.canvas({ "aria-hidden": "true", ...attributes });
    this.context = this.node.getContext("2d");
    this.frame = 0;
    this.sizeObserver = new ResizeObserver(() => this.later());
    this.sizeObserver.observe(this.node);
    this.darkQuery = matchMedia("(prefers-color-scheme: dark)");
    this.recolour = () => {
      colours = null;
      this.later();
    };
    this.darkQuery.addEventListener("change", this.recolour);
    this.themeObserver = new MutationObserver(this.recolour); // the page's own switch for light and dark
    this.themeObserver.observe(document.documentElement, { attributes: true });
  }

  get width() {
    return this.node.clientWidth;
  }
  get height() {
    return this.node.clientHeight;
  }

  /** Draw in the next frame. */
  later() {
    this.frame ||= requestAnimationFrame(() => {
      this.frame = 0;
      this.draw();
    });
  }

  draw() {
    const { width, height, node, context } = this,
      density = Math.min(window.devicePixelRatio || 1, 3); // limits the number of pixels to draw
    if (!width || !height) return;
    const [pixelWidth, pixelHeight] = [Math.round(width * density), Math.round(height * density)];
    // an assignment clears the canvas and allocates it again, even without a change
    if (node.width !== pixelWidth) node.width = pixelWidth;
    if (node.height !== pixelHeight) node.height = pixelHeight;
    context.setTransform(density, 0, 0, density, 0, 0);
    context.font = FONT;
    this.paint(context, width, height, palette());
  }

  /** End all listening; called when the canvas leaves the page. */
  gone() {
    cancelAnimationFrame(this.frame);
    this.sizeObserver.disconnect();
    this.themeObserver.disconnect();
    this.darkQuery.removeEventListener("change", this.recolour);
  }
}

/**
 * Fill and stroke the path of a context.
 * @param look the colours `fill` and `stroke`, of which one may be missing; `width` and `dash` of the line in
 * pixels; `alpha`, the opacity
 */
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
  context.arc(x, y, radius, 0, 7); // 7 > 2 pi: the whole circle
  ink(context, look);
}
export function fillBox(context, colour, x, y, width, height, alpha = 1) {
  context.globalAlpha = alpha;
  context.fillStyle = colour;
  context.fillRect(x, y, width, height);
  context.globalAlpha = 1;
}

const CLICK_RADIUS = 4, // pixels: a press that moves less is a click
  LINE_HEIGHT = 16, // pixels a line, for wheels that count lines
  WHEEL = 500, // pixels of the wheel that scale by e
  PINCHED_WHEEL = 120, // the same for two fingers on a touchpad, which browsers report as a wheel with Ctrl
  LEAST_DISTANCE = 10; // pixels between two fingers; a smaller distance would scale without limit
/**
 * Listen to the gestures on a node. All places are pixels within the node.
 * @param handlers.pan(dx, dy) moves the drawing; handlers.zoom(factor, x, y) scales it around a point;
 * handlers.point(x, y) gets the moves of a pointer that is not pressed; handlers.leave() the end of pointing;
 * handlers.press(x, y) a click; handlers.grab(x, y), which is optional, may return a function that gets the
 * places of a drag in place of pan and zoom
 */
export function gestures(node, handlers) {
  const pressed = new Map(); // id of a pressed pointer -> its place
  let isMoved = false, // the press is no click any more
    drag = null; // the function that grab() has returned
  const place = (event) => {
    const box = node.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  node.style.touchAction = "none"; // the browser would scroll and scale the page, and cancel the pointers
  const wheel = (event) => {
    const { x, y } = place(event),
      scale = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_HEIGHT : 1,
      [dx, dy] = [event.deltaX * scale, event.deltaY * scale];
    event.preventDefault();
    if (event.shiftKey || Math.abs(dx) > Math.abs(dy)) handlers.pan(-(dx || dy), 0);
    else handlers.zoom(Math.exp(-dy / (event.ctrlKey ? PINCHED_WHEEL : WHEEL)), x, y);
  };
  node.addEventListener("wheel", wheel, { passive: false }); // a passive listener cannot prevent scrolling
  node.addEventListener("pointerdown", (event) => {
    if (event.button > 0) return;
    const at = place(event);
    node.setPointerCapture(event.pointerId); // a drag continues outside of the node
    pressed.set(event.pointerId, at);
    isMoved = pressed.size > 1;
    handlers.leave();
    drag = (pressed.size === 1 && handlers.grab?.(at.x, at.y)) || null;
  });
  node.addEventListener("pointermove", (event) => {
    const at = place(event),
      before = pressed.get(event.pointerId);
    if (!before) {
      if (event.pointerType !== "touch") handlers.point(at.x, at.y);
      return;
    }
    if (drag) drag(at.x, at.y);
    if (drag || (!isMoved && Math.hypot(at.x - before.x, at.y - before.y) <= CLICK_RADIUS)) return;
    isMoved = true;
    pressed.set(event.pointerId, at);
    const [, otherPlace] = [...pressed].find(([id]) => id !== event.pointerId) || [];
    const distance = (point) =>
      Math.max(LEAST_DISTANCE, Math.hypot(point.x - otherPlace.x, point.y - otherPlace.y));
    if (!otherPlace) handlers.pan(at.x - before.x, at.y - before.y);
    else handlers.zoom(distance(at) / distance(before), (at.x + otherPlace.x) / 2, (at.y + otherPlace.y) / 2);
  });
  for (const end of ["pointerup", "pointercancel"])
    node.addEventListener(end, (event) => {
      const wasDown = pressed.delete(event.pointerId),
        { x, y } = place(event);
      if (wasDown && !isMoved && !drag && end === "pointerup") handlers.press(x, y);
      if (!pressed.size) drag = null;
    });
  node.addEventListener("pointerleave", () => handlers.leave());
}

/**
 * Listen to the keys of a drawing. They do not reach the page, where digits lead to other views.
 * @param actions functions by key
 */
export function drawingKeys(box, actions) {
  box.addEventListener("keydown", (event) => {
    const action = actions[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey || !action) return;
    action(event);
    event.preventDefault();
    event.stopPropagation();
  });
}
