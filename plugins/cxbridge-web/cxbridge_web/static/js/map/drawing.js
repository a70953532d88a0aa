// The map on a canvas: a grid in metres, the navigation graph, frames, robots and their trails. Places on the
// map are metres, places on the canvas pixels, whose y axis points down.
import { Canvas, dashOf, dot, drawingKeys, fillBox, gestures, line, niceStep } from "cx/canvas.js";
import { el } from "cx/dom.js";

const MIN_SCALE = 2, // pixels a metre
  MAX_SCALE = 4000, // pixels a metre
  KEY_STEP = 40, // pixels that an arrow key moves the map
  KEY_ZOOM = 1.3, // the factor of a key
  MARGIN = 1.25; // the width of the fitted map, as a multiple of the width of its items
const NEAR = 14; // the distance in pixels at which an item counts as pointed at
const AXES = ["#d1242f", "#1a7f37"]; // x and y of a frame, as in rviz

export class Drawing {
  /**
   * @param handlers hover(item or null), pick(item or null), moved() after the user moved or scaled the map
   */
  constructor(handlers) {
    // scale: pixels a metre; x, y: the place in the middle; gridStep: metres between two lines of the grid
    Object.assign(this, {
      handlers,
      scale: 80,
      x: 0,
      y: 0,
      graphs: [],
      items: [],
      hovered: null,
      fitted: "", // the size of the canvas to which the map was fitted; "" after a move
      gridStep: 1,
    });
    this.canvas = new Canvas((...args) => this.paint(...args));
    this.box = el(
      "div.map-box",
      {
        tabindex: 0,
        role: "application",
        "aria-roledescription": "map",
        "aria-label": "Map; the table beside the map has its items",
        "aria-keyshortcuts": "ArrowLeft ArrowRight ArrowUp ArrowDown Plus Minus 0",
      },
      this.canvas.node,
    );
    gestures(this.canvas.node, {
      pan: (dx, dy) => this.move(dx, dy),
      zoom: (factor, x, y) => this.zoom(factor, x, y),
      point: (x, y) => this.hover(this.itemNear(x, y)),
      leave: () => this.hover(null),
      press: (x, y) => handlers.pick(this.itemNear(x, y)),
    });
    const zoomIn = () => this.zoom(KEY_ZOOM);
    drawingKeys(this.box, {
      ArrowLeft: () => this.move(KEY_STEP, 0),
      ArrowRight: () => this.move(-KEY_STEP, 0),
      ArrowUp: () => this.move(0, KEY_STEP),
      ArrowDown: () => this.move(0, -KEY_STEP),
      "+": zoomIn,
      "=": zoomIn, // the key of + without Shift
      "-": () => this.zoom(1 / KEY_ZOOM),
      0: () => this.fit(),
    });
  }

  /**
   * Show these graphs and items.
   * @param graphs {name, nodes, edges}[]
   * @param items {x, y, yaw (null: no direction), name, label (of a robot; empty: its name), kind,
   * colourNumber, seen, trail, goal, isMarked}[]
   */
  show(graphs, items) {
    Object.assign(this, { graphs, items });
    this.canvas.later();
  }

  move(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.fitted = "";
    this.handlers.moved();
    this.canvas.later();
  }
  /** Scale the map around a pixel, whose place on the map stays below it. */
  zoom(factor, x = this.canvas.width / 2, y = this.canvas.height / 2) {
    const [xBefore, yBefore] = this.toMetres(x, y);
    this.scale = Math.min(MAX_SCALE, Math.max(MIN_SCALE, this.scale * factor));
    const [xAfter, yAfter] = this.toMetres(x, y);
    this.x += xBefore - xAfter;
    this.y += yBefore - yAfter;
    this.move(0, 0);
  }
  /** Move the map so that a place is in the middle. */
  centre(x, y) {
    Object.assign(this, { x, y });
    this.canvas.later();
  }
  /** Show all nodes, items and trails. Returns false if there is neither node nor item, or no size yet. */
  fit() {
    const { width, height } = this.canvas,
      nodes = this.graphs.flatMap((graph) => Object.values(graph.nodes)),
      points = [
        ...[...nodes, ...this.items].map(({ x, y }) => [x, y]),
        ...this.items.flatMap(({ trail }) => trail),
      ];
    if (!points.length || !width) return false;
    const range = (axis) =>
      points.reduce(
        ([least, most], point) => [Math.min(least, point[axis]), Math.max(most, point[axis])],
        [Infinity, -Infinity],
      );
    const [left, right] = range(0),
      [low, high] = range(1),
      scaleFor = (room, span) => room / Math.max(1, span * MARGIN), // at least a metre is visible
      scale = Math.min(scaleFor(width, right - left), scaleFor(height, high - low));
    this.scale = Math.min(MAX_SCALE, Math.max(MIN_SCALE, scale));
    this.fitted = width + " " + height;
    this.centre((left + right) / 2, (low + high) / 2);
    return true;
  }

  /** The pixel of a place on the map. */
  toPixels(x, y) {
    const { width, height } = this.canvas;
    return [width / 2 + (x - this.x) * this.scale, height / 2 - (y - this.y) * this.scale];
  }
  /** The place on the map of a pixel. */
  toMetres(x, y) {
    const { width, height } = this.canvas;
    return [this.x + (x - width / 2) / this.scale, this.y - (y - height / 2) / this.scale];
  }

  /** The first robot, frame or node within NEAR of a pixel; null if there is none. */
  itemNear(x, y) {
    const nodes = this.graphs.flatMap((graph) => Object.entries(graph.nodes)),
      candidates = [...this.items, ...nodes.map(([name, node]) => ({ ...node, name, kind: "node" }))];
    const isClose = (item) => {
      const [left, top] = this.toPixels(item.x, item.y);
      return Math.hypot(left - x, top - y) <= NEAR;
    };
    return candidates.find(isClose) || null;
  }
  hover(item) {
    if (item?.name === this.hovered?.name) return;
    this.hovered = item;
    this.handlers.hover(item);
  }

  paint(context, width, height, colours) {
    if (this.fitted && this.fitted !== width + " " + height) this.fit(); // the room has changed
    fillBox(context, colours.back, 0, 0, width, height);
    this.paintGrid(context, width, height, colours);
    for (const graph of this.graphs) this.paintGraph(context, graph, colours);
    for (const item of this.items) this.paintTrail(context, item, colours);
    for (const item of this.items) {
      if (item.kind === "frame") this.paintFrame(context, item, colours);
      else this.paintRobot(context, item, colours);
    }
    this.paintScale(context, height, colours);
  }

  /** Draw lines at round distances, about 90 pixels apart; the lines through the origin are stronger. */
  paintGrid(context, width, height, colours) {
    const step = (this.gridStep = niceStep(width / this.scale, width / 90)),
      [left, top] = this.toMetres(0, 0),
      [right, low] = this.toMetres(width, height),
      look = (index) => ({ stroke: colours.line, alpha: index === 0 ? 1 : 0.45 });
    for (let index = Math.ceil(left / step); index * step <= right; index++)
      line(context, [this.toPixels(index * step, top), this.toPixels(index * step, low)], look(index));
    for (let index = Math.ceil(low / step); index * step <= top; index++)
      line(context, [this.toPixels(left, index * step), this.toPixels(right, index * step)], look(index));
  }

  /** Draw a bar as long as a step of the grid, with its length, at the lower left. */
  paintScale(context, height, { text: colour }) {
    const length = this.gridStep * this.scale,
      text = this.gridStep >= 1 ? this.gridStep + " m" : Math.round(this.gridStep * 100) + " cm",
      [left, right, top, low] = [14, 14 + length, height - 20, height - 14];
    line(
      context,
      [
        [left, top],
        [left, low],
        [right, low],
        [right, top],
      ],
      { stroke: colour, width: 2 },
    );
    context.fillStyle = colour;
    context.textAlign = "center";
    context.textBaseline = "bottom";
    context.fillText(text, left + length / 2, height - 17);
  }

  paintGraph(context, { nodes, edges }, colours) {
    for (const { from, to, directed } of Object.values(edges)) {
      if (!nodes[from] || !nodes[to]) continue;
      const ends = [nodes[from], nodes[to]].map(({ x, y }) => this.toPixels(x, y));
      line(context, ends, { stroke: colours.dim, width: 1.6 });
      if (directed) this.paintArrow(context, ...ends, colours.dim);
    }
    const { width, height } = this.canvas,
      // each name needs about 900 square pixels: names would cover a crowded map with a small scale
      isNamed = Object.keys(nodes).length * 900 < width * height || this.scale > 60;
    for (const [name, node] of Object.entries(nodes)) {
      const [x, y] = this.toPixels(node.x, node.y),
        fill = node.unconnected ? colours.back : colours.panel;
      dot(context, x, y, 5, { fill, stroke: colours.dim, width: 1.6 });
      if (isNamed) this.paintText(context, name, x + 8, y - 5, colours.text, colours.back, "bottom");
    }
  }
  paintText(context, text, x, y, colour, back, baseline = "top") {
    Object.assign(context, { textAlign: "left", textBaseline: baseline, lineJoin: "round", lineWidth: 3 });
    context.strokeStyle = back;
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
  }
  /** Draw a shape at a place, turned by an angle. @param points [x, y] around the place */
  shape(context, [x, y], angle, points, look) {
    context.save();
    context.translate(x, y);
    context.rotate(angle);
    line(context, points, look);
    context.restore();
  }
  paintArrow(context, [x1, y1], [x2, y2], fill) {
    const place = [(x1 + 2 * x2) / 3, (y1 + 2 * y2) / 3];
    this.shape(context, place, Math.atan2(y2 - y1, x2 - x1), ARROW, { fill });
  }

  /** Draw the path of an item, and a dotted line to the goal of its navigator. */
  paintTrail(context, { colourNumber, kind, trail, goal, x, y }, { series }) {
    const look = { stroke: series[colourNumber], alpha: 0.6, width: kind === "frame" ? 1.2 : 2.4 },
      way = trail.map((point) => this.toPixels(...point));
    line(context, way, { ...look, dash: dashOf(colourNumber) });
    if (!goal) return;
    const place = this.toPixels(goal.x, goal.y);
    line(context, [this.toPixels(x, y), place], { ...look, dash: [2, 4] });
    dot(context, ...place, 6, { ...look, dash: [2, 4] });
  }

  paintRobot(context, item, colours) {
    const place = this.toPixels(item.x, item.y),
      [x, y] = place,
      size = Math.max(10, Math.min(26, 0.16 * this.scale)), // a radius of 16 cm, but 10 to 26 pixels
      alpha = item.seen ? 1 : 0.45,
      look = { fill: colours.series[item.colourNumber], stroke: colours.back, width: 2, alpha };
    if (item.yaw === null) dot(context, x, y, size * 0.7, look);
    else
      this.shape(
        context,
        place,
        -item.yaw, // the y axis of the canvas points down
        ROBOT.map((point) => point.map((coordinate) => coordinate * size)),
        look,
      );
    if (item.isMarked) dot(context, x, y, size + 6, { stroke: colours.focus, width: 2 });
    this.paintText(context, item.label || item.name, x + size + 4, y + 4, colours.text, colours.back);
  }

  paintFrame(context, item, colours) {
    const [x, y] = this.toPixels(item.x, item.y);
    for (const [axis, stroke] of AXES.entries()) {
      const angle = (item.yaw ?? 0) + (axis * Math.PI) / 2, // the y axis is a quarter turn from the x axis
        end = [x + 20 * Math.cos(angle), y - 20 * Math.sin(angle)];
      line(context, [[x, y], end], { stroke, width: 2.2 });
    }
    this.paintText(context, item.name, x + 4, y + 5, colours.dim, colours.back);
  }

  /** End all listening; called when the map leaves the page. */
  gone() {
    this.canvas.gone();
  }
}

// shapes that point along the x axis: [x, y], in pixels of an arrow, in radii of a robot
const ARROW = [
    [6, 0],
    [-4, -4],
    [-4, 4],
  ],
  ROBOT = [
    [1, 0],
    [-0.75, -0.7],
    [-0.35, 0],
    [-0.75, 0.7],
  ];
