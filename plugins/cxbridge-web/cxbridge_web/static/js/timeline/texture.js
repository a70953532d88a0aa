// Colours and textures of outcomes for a canvas: those of css/outcomes.css.
import { NAMES, OUTCOMES } from "cx/outcome.js";

const SIZE = 8;

/** @param draw called with a context of SIZE x SIZE; what it draws repeats without a seam */
function tile(ratio, draw) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SIZE * ratio;
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  draw(context);
  return canvas;
}
function line(context, ...points) {
  context.beginPath();
  for (const [x, y, a, b] of points) {
    context.moveTo(x, y);
    context.lineTo(a, b);
  }
  context.stroke();
}
// strokes reach over the edge, so that the corners are filled too
const RISING = [
  [-1, 9, 9, -1],
  [-1, 1, 1, -1],
  [7, 9, 9, 7],
];
const FALLING = RISING.map(([x, y, a, b]) => [SIZE - x, y, SIZE - a, b]);
/** By outcome; those without a texture are plain. */
const DRAW = {
  formulated(context) {
    for (const [x, y] of [
      [2, 2],
      [6, 6],
    ])
      context.fillRect(x - 0.6, y - 0.6, 1.2, 1.2);
  },
  running: (context) => line(context, ...RISING),
  failed: (context) => line(context, ...RISING, ...FALLING),
  rejected: (context) => line(context, [0, 2, 8, 2], [0, 6, 8, 6]),
};
const STRENGTH = { formulated: 0.7, running: 0.28, failed: 0.5, rejected: 0.4 };

/**
 * What a page's colours are now, light or dark.
 * @param root an element in whose colours the canvas is drawn
 */
export function palette(root, ratio) {
  const probe = cx.el("span", { hidden: true });
  root.append(probe);
  const color = (value) => {
    probe.style.color = value;
    return getComputedStyle(probe).color;
  };
  const outcomes = {};
  for (const name of NAMES) {
    const edge = color(`var(--outcome-${name}-edge)`),
      draw = DRAW[name];
    const pattern =
      draw &&
      tile(ratio, (context) => {
        context.strokeStyle = context.fillStyle = edge;
        context.globalAlpha = STRENGTH[name];
        context.lineWidth = 1.3;
        draw(context);
      });
    outcomes[name] = {
      fill: color(`var(--outcome-${name})`),
      edge,
      ink: color(`var(--outcome-${name}-ink)`),
      icon: OUTCOMES[name].icon,
      pattern: pattern && document.createElement("canvas").getContext("2d").createPattern(pattern, "repeat"),
    };
    if (outcomes[name].pattern)
      outcomes[name].pattern.setTransform(new DOMMatrix().scale(1 / ratio, 1 / ratio));
  }
  const found = {
    outcomes,
    back: color("var(--card, var(--back))"),
    panel: color("var(--panel)"),
    line: color("var(--line)"),
    text: color("var(--text)"),
    dim: color("var(--dim)"),
    focus: color("var(--focus)"),
    error: color("var(--outcome-failed-edge)"),
  };
  probe.remove();
  return found;
}
