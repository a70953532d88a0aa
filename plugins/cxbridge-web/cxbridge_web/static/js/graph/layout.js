// A layered layout, as dot makes it but simpler: layers from the start, crossings reduced by medians, edges
// through places in the layers between. Between two layers of nodes is one for labels.
const GAP_X = 26,
  GAP_Y = 22,
  SWEEPS = 8,
  PUSHES = 12,
  PLACE = 12, // the width of a line that passes a layer
  LOOP = [
    [0, -8],
    [26, -14],
    [26, 14],
    [0, 8],
  ];

/**
 * @param nodes [{name, width, height}], the first is where it starts unless others have no way in
 * @param edges [{from, to, width, height}], the size is that of its label
 * @returns {width, height, nodes: Map name -> {x, y} (middle), edges: [{path: [{x, y}, ...], label: {x, y}}]}
 */
export function layered(nodes, edges) {
  const byName = new Map(nodes.map((node) => [node.name, { ...node, layer: -1, above: [], below: [] }])),
    back = backEdges([...byName.keys()], edges),
    ends = ({ from, to }, number) =>
      (back.has(number) ? [to, from] : [from, to]).map((name) => byName.get(name)),
    ways = edges.map((edge, number) => (edge.from === edge.to ? null : ends(edge, number)));
  rank([...byName.values()], ways.filter(Boolean));
  const layers = [],
    put = (node) => (layers[node.layer] ??= []).push(node);
  for (const node of byName.values()) put(node);
  for (let at = 0; at < layers.length; at++) layers[at] ??= [];
  // an edge passes each layer between its ends in a separate place
  const chains = ways.map((way, number) => way && chainOf(...way, edges[number], put));
  for (const chain of chains.filter(Boolean))
    for (const [at, node] of chain.slice(1).entries()) {
      chain[at].below.push(node);
      node.above.push(chain[at]);
    }
  order(layers);
  const width = place(layers);
  let top = 0;
  for (const layer of layers) {
    const high = Math.max(0, ...layer.map((node) => node.height));
    for (const node of layer) node.y = top + high / 2;
    top += high + GAP_Y;
  }
  const paths = edges.map((edge, number) =>
    chains[number] ? pathOf(chains[number], back.has(number)) : loopOf(byName.get(edge.from), edge),
  );
  return { width, height: Math.max(0, top - GAP_Y), nodes: byName, edges: paths };
}

/** The places of an edge in the layers between its ends; in the middle one is the label. */
function chainOf(from, to, { width, height }, put) {
  const middle = from.layer + 2 * Math.floor((to.layer - from.layer) / 4) + 1,
    places = [];
  for (let layer = from.layer + 1; layer < to.layer; layer++) {
    const isLabel = layer === middle,
      size = isLabel ? { width: Math.max(width, PLACE), height } : { width: PLACE, height: 0 };
    places.push({ ...size, layer, isLabel, above: [], below: [] });
  }
  places.forEach(put);
  return [from, ...places, to];
}
function pathOf(chain, isBack) {
  const last = chain.length - 1,
    edgeOf = ({ height }, at) => (at === 0 ? height / 2 : at === last ? -height / 2 : 0),
    path = chain.map((node, at) => ({ x: node.x, y: node.y + edgeOf(node, at) }));
  return { path: isBack ? path.reverse() : path, label: chain.find((node) => node.isLabel) };
}
function loopOf({ x: middle, y, width }, edge) {
  const x = middle + width / 2;
  return {
    path: LOOP.map(([dx, dy]) => ({ x: x + dx, y: y + dy })),
    label: { x: x + 26 + edge.width / 2, y },
  };
}

/** Numbers of the edges that close a circle. */
function backEdges(names, edges) {
  const out = Map.groupBy(edges.keys(), (number) => edges[number].from),
    comesIn = new Set(edges.filter(({ from, to }) => from !== to).map(({ to }) => to)),
    found = new Set(),
    state = new Map();
  for (const start of names.sort((a, b) => comesIn.has(a) - comesIn.has(b))) {
    const stack = state.has(start) ? [] : [[start, 0]];
    while (stack.length) {
      const top = stack.at(-1),
        number = out.get(top[0])?.[top[1]++],
        next = edges[number]?.to;
      state.set(top[0], "open");
      if (number === undefined) {
        state.set(top[0], "done");
        stack.pop();
      } else if (state.get(next) === "open") found.add(number);
      else if (!state.has(next)) stack.push([next, 0]);
    }
  }
  return found;
}

/** The longest way from a start gives the layer. */
function rank(nodes, ways) {
  const left = new Map(nodes.map((node) => [node, ways.filter(([, to]) => to === node).length])),
    ready = nodes.filter((node) => !left.get(node));
  for (const node of ready) node.layer = 0;
  for (const node of ready)
    for (const [from, next] of ways) {
      if (from !== node) continue;
      next.layer = Math.max(next.layer, node.layer + 2);
      left.set(next, left.get(next) - 1);
      if (!left.get(next)) ready.push(next);
    }
}

const number = (layer) => layer.forEach((node, at) => (node.at = at));
/** Reduce crossings: each node goes to the median of its neighbours, down and up in turn. */
function order(layers) {
  for (let sweep = 0; sweep < SWEEPS; sweep++) {
    const down = sweep % 2 === 0;
    layers.forEach(number);
    for (const layer of down ? layers : [...layers].reverse()) {
      for (const node of layer) {
        const near = (down ? node.above : node.below).map((each) => each.at).sort((a, b) => a - b);
        node.key = near.length ? (near[(near.length - 1) >> 1] + near[near.length >> 1]) / 2 : node.at;
      }
      layer.sort((a, b) => a.key - b.key);
      number(layer);
    }
  }
}

const rightOf = (node) => (node ? node.x + node.width / 2 : 0);
/** Give each node its x: near its neighbours, without touching the one beside it. Returns the width. */
function place(layers) {
  for (const layer of layers) {
    let x = 0;
    for (const node of layer) {
      node.x = x + node.width / 2;
      x += node.width + GAP_X;
    }
  }
  const widest = Math.max(0, ...layers.map((layer) => rightOf(layer.at(-1))));
  for (const layer of layers) {
    const shift = (widest - rightOf(layer.at(-1))) / 2;
    for (const node of layer) node.x += shift;
  }
  for (let sweep = 0; sweep < SWEEPS; sweep++)
    for (const layer of sweep % 2 ? [...layers].reverse() : layers) {
      const wishes = layer.map((node) => {
        const near = [...node.above, ...node.below];
        return near.length ? near.reduce((sum, each) => sum + each.x, 0) / near.length : node.x;
      });
      layer.forEach((node, at) => (node.x = wishes[at]));
      apart(layer);
    }
  const all = layers.flat(),
    least = Math.min(...all.map((node) => node.x - node.width / 2));
  for (const node of all) node.x -= least;
  return Math.max(0, ...all.map(rightOf));
}

/** Push neighbours of a layer apart, to both sides alike; what is still too near goes to the right. */
function apart(layer) {
  const pairs = layer.slice(1).map((node, at) => [layer[at], node]),
    lack = ([a, b]) => (a.width + b.width) / 2 + GAP_X - (b.x - a.x);
  for (let push = 0; push < PUSHES && pairs.some((pair) => lack(pair) > 0.5); push++)
    for (const pair of pairs) {
      const half = Math.max(0, lack(pair)) / 2;
      pair[0].x -= half;
      pair[1].x += half;
    }
  for (const pair of pairs) pair[1].x += Math.max(0, lack(pair));
}
