// The map on a canvas: a grid in metres, the navigation graph, frames, robots and their trails.
import { Canvas, niceStep } from "cx/canvas.js";
import { el } from "cx/dom.js";
import { dashOf } from "cx/plot/chart.js";
import { gestures } from "cx/panzoom.js";

const LEAST = 2,
  MOST = 4000, // pixels a metre
  STEP = 40,
  ZOOM = 1.3,
  MARGIN = 1.25;
const NEAR = 14; // pixels around something that count as it

export class Drawing {
  /** @param handlers.hover(item or null), handlers.pick(item) something on the map; handlers.moved() by hand */
  constructor(handlers) {
    Object.assign(this, { handlers, scale: 80, x: 0, y: 0, graphs: [], items: [], hot: null, grid: 1 });
    this.canvas = new Canvas((...rest) => this.paint(...rest));
    this.box = el(
      "div.map-box",
      {
        tabindex: 0,
        role: "application",
        "aria-roledescription": "map",
        "aria-label": "Map; what is on it is in the table beside it",
        "aria-keyshortcuts": "ArrowLeft ArrowRight ArrowUp ArrowDown Plus Minus 0",
      },
      this.canvas.node,
    );
    gestures(this.canvas.node, {
      pan: (dx, dy) => this.move(dx, dy),
      zoom: (factor, x, y) => this.zoom(factor, x, y),
      point: (x, y) => this.hover(this.near(x, y)),
      leave: () => this.hover(null),
      press: (x, y) => handlers.pick(this.near(x, y)),
    });
    this.box.addEventListener("keydown", (event) => this.onKey(event));
  }

  /** @param items {x, y, yaw, name, kind, number, seen, trail, goal, marked}; graphs: {name, nodes, edges} */
  show(graphs, items) {
    this.graphs = graphs;
    this.items = items;
    this.canvas.later();
  }

  move(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.fitted = "";
    this.handlers.moved();
    this.canvas.later();
  }
  zoom(factor, x = this.canvas.width / 2, y = this.canvas.height / 2) {
    const before = this.metres(x, y);
    this.scale = Math.min(MOST, Math.max(LEAST, this.scale * factor));
    const after = this.metres(x, y);
    this.x += before.x - after.x;
    this.y += before.y - after.y;
    this.fitted = "";
    this.handlers.moved();
    this.canvas.later();
  }
  centre(x, y) {
    this.x = x;
    this.y = y;
    this.canvas.later();
  }
  /** Show all there is. Returns whether there is anything. */
  fit() {
    const points = [
      ...this.graphs.flatMap(({ nodes }) => Object.values(nodes).map(({ x, y }) => [x, y])),
      ...this.items.flatMap((item) => [[item.x, item.y], ...item.trail]),
    ];
    const { width, height } = this.canvas;
    if (!points.length || !width) return false;
    const range = (at) => {
      let least = Infinity,
        greatest = -Infinity;
      for (const point of points) {
        least = Math.min(least, point[at]);
        greatest = Math.max(greatest, point[at]);
      }
      return [least, greatest];
    };
    const [left, right] = range(0),
      [low, high] = range(1);
    this.x = (left + right) / 2;
    this.y = (low + high) / 2;
    const scale = Math.min(
      width / Math.max(1, (right - left) * MARGIN),
      height / Math.max(1, (high - low) * MARGIN),
    );
    this.scale = Math.min(MOST, Math.max(LEAST, scale));
    this.fitted = width + " " + height;
    this.canvas.later();
    return true;
  }

  px(x) {
    return this.canvas.width / 2 + (x - this.x) * this.scale;
  }
  py(y) {
    return this.canvas.height / 2 - (y - this.y) * this.scale;
  }
  metres(x, y) {
    return {
      x: this.x + (x - this.canvas.width / 2) / this.scale,
      y: this.y - (y - this.canvas.height / 2) / this.scale,
    };
  }

  /** What is at a pixel: a robot or frame, else a node. */
  near(x, y) {
    const close = (each) => Math.hypot(this.px(each.x) - x, this.py(each.y) - y) <= NEAR;
    const item = this.items.find(close);
    if (item) return item;
    for (const { nodes } of this.graphs)
      for (const [name, node] of Object.entries(nodes))
        if (close(node)) return { ...node, name, kind: "node" };
    return null;
  }
  hover(found) {
    if ((found && found.name) === (this.hot && this.hot.name)) return;
    this.hot = found;
    this.handlers.hover(found);
  }

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const way = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (way) this.move(way[0] * STEP, way[1] * STEP);
    else if (event.key === "+" || event.key === "=") this.zoom(ZOOM);
    else if (event.key === "-") this.zoom(1 / ZOOM);
    else if (event.key === "0") this.fit();
    else return;
    event.preventDefault();
    event.stopPropagation(); // numbers lead to other views
  }

  paint(context, width, height, colours) {
    if (this.fitted && this.fitted !== width + " " + height) this.fit(); // the room has changed
    context.fillStyle = colours.back;
    context.fillRect(0, 0, width, height);
    this.paintGrid(context, width, height, colours);
    for (const graph of this.graphs) this.paintGraph(context, graph, colours);
    for (const item of this.items) this.paintTrail(context, item, colours);
    for (const item of this.items) {
      if (item.kind === "frame") this.paintFrame(context, item, colours);
      else this.paintRobot(context, item, colours);
    }
    this.paintScale(context, height, colours);
  }

  paintGrid(context, width, height, colours) {
    const step = (this.grid = niceStep(width / this.scale, width / 90)),
      { x: left, y: top } = this.metres(0, 0),
      { x: right, y: low } = this.metres(width, height);
    context.strokeStyle = colours.line;
    context.lineWidth = 1;
    for (const [from, to, isAcross] of [
      [left, right, false],
      [low, top, true],
    ])
      for (let at = Math.ceil(from / step); at * step <= to; at++) {
        context.globalAlpha = at === 0 ? 1 : 0.45;
        context.beginPath();
        if (isAcross) {
          context.moveTo(0, this.py(at * step));
          context.lineTo(width, this.py(at * step));
        } else {
          context.moveTo(this.px(at * step), 0);
          context.lineTo(this.px(at * step), height);
        }
        context.stroke();
      }
    context.globalAlpha = 1;
  }

  paintScale(context, height, colours) {
    const wide = this.grid * this.scale,
      text = this.grid >= 1 ? this.grid + " m" : Math.round(this.grid * 100) + " cm";
    context.strokeStyle = context.fillStyle = colours.text;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(14, height - 20);
    context.lineTo(14, height - 14);
    context.lineTo(14 + wide, height - 14);
    context.lineTo(14 + wide, height - 20);
    context.stroke();
    context.textAlign = "center";
    context.textBaseline = "bottom";
    context.fillText(text, 14 + wide / 2, height - 17);
  }

  paintGraph(context, { nodes, edges }, colours) {
    context.strokeStyle = context.fillStyle = colours.dim;
    context.lineWidth = 1.6;
    for (const edge of Object.values(edges)) {
      const from = nodes[edge.from],
        to = nodes[edge.to];
      if (!from || !to) continue;
      context.beginPath();
      context.moveTo(this.px(from.x), this.py(from.y));
      context.lineTo(this.px(to.x), this.py(to.y));
      context.stroke();
      if (edge.directed) this.paintArrow(context, from, to);
    }
    context.textAlign = "left";
    context.textBaseline = "bottom";
    const named = Object.keys(nodes).length * 900 < this.canvas.width * this.canvas.height || this.scale > 60;
    for (const [name, node] of Object.entries(nodes)) {
      const x = this.px(node.x),
        y = this.py(node.y);
      context.beginPath();
      context.arc(x, y, 5, 0, 7);
      context.fillStyle = node.unconnected ? colours.back : colours.panel;
      context.strokeStyle = colours.dim;
      context.fill();
      context.stroke();
      if (named) this.paintText(context, name, x + 8, y - 5, colours.text, colours.back);
    }
  }

  paintText(context, text, x, y, colour, back) {
    context.lineJoin = "round";
    context.lineWidth = 3;
    context.strokeStyle = back;
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
    context.lineWidth = 1.6;
  }

  paintArrow(context, from, to) {
    const angle = Math.atan2(this.py(to.y) - this.py(from.y), this.px(to.x) - this.px(from.x)),
      x = this.px((from.x + 2 * to.x) / 3),
      y = this.py((from.y + 2 * to.y) / 3);
    context.save();
    context.translate(x, y);
    context.rotate(angle);
    context.beginPath();
    context.moveTo(6, 0);
    context.lineTo(-4, -4);
    context.lineTo(-4, 4);
    context.closePath();
    context.fill();
    context.restore();
  }

  paintTrail(context, item, colours) {
    const colour = colours.series[item.number];
    context.strokeStyle = colour;
    context.globalAlpha = 0.6;
    context.lineWidth = item.kind === "frame" ? 1.2 : 2.4;
    context.setLineDash(dashOf(item.number));
    context.beginPath();
    item.trail.forEach(([x, y], at) => {
      if (at) context.lineTo(this.px(x), this.py(y));
      else context.moveTo(this.px(x), this.py(y));
    });
    context.stroke();
    if (item.goal) {
      context.setLineDash([2, 4]);
      context.beginPath();
      context.moveTo(this.px(item.x), this.py(item.y));
      context.lineTo(this.px(item.goal.x), this.py(item.goal.y));
      context.arc(this.px(item.goal.x), this.py(item.goal.y), 6, 0, 7);
      context.stroke();
    }
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  paintRobot(context, item, colours) {
    const x = this.px(item.x),
      y = this.py(item.y),
      size = Math.max(10, Math.min(26, 0.16 * this.scale));
    context.save();
    context.translate(x, y);
    context.globalAlpha = item.seen ? 1 : 0.45;
    context.fillStyle = colours.series[item.number];
    context.strokeStyle = colours.back;
    context.lineWidth = 2;
    context.beginPath();
    if (item.yaw === null) context.arc(0, 0, size * 0.7, 0, 7);
    else {
      context.rotate(-item.yaw);
      context.moveTo(size, 0);
      context.lineTo(-size * 0.75, -size * 0.7);
      context.lineTo(-size * 0.35, 0);
      context.lineTo(-size * 0.75, size * 0.7);
      context.closePath();
    }
    context.fill();
    context.stroke();
    context.restore();
    if (item.marked) {
      context.strokeStyle = colours.focus;
      context.lineWidth = 2;
      context.beginPath();
      context.arc(x, y, size + 6, 0, 7);
      context.stroke();
    }
    context.textAlign = "left";
    context.textBaseline = "top";
    this.paintText(context, item.label || item.name, x + size + 4, y + 4, colours.text, colours.back);
  }

  paintFrame(context, item, colours) {
    const x = this.px(item.x),
      y = this.py(item.y);
    context.lineWidth = 2.2;
    for (const [turn, colour] of [
      [0, "#d1242f"],
      [Math.PI / 2, "#1a7f37"],
    ]) {
      const angle = (item.yaw ?? 0) + turn;
      context.strokeStyle = colour;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + 20 * Math.cos(angle), y - 20 * Math.sin(angle));
      context.stroke();
    }
    context.textAlign = "left";
    context.textBaseline = "top";
    this.paintText(context, item.name, x + 4, y + 5, colours.dim, colours.back);
  }

  gone() {
    this.canvas.gone();
  }
}
