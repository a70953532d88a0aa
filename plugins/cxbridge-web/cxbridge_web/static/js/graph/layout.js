// A layered layout, as dot makes it but simpler: layers from the start, crossings reduced by medians,
// edges through places in the
// layers between. Between two layers of nodes is one for labels.
const GAP_X = 26,
  GAP_Y = 22,
  SWEEPS = 8;

/**
 * @param nodes [{name, width, height}], the first is where it starts unless others have no way in
 * @param edges [{from, to, width, height}], the size is that of its label
 * @returns {width, height, nodes: Map name -> {x, y} (middle), edges: [{path: [{x, y}, ...], label: {x, y}}]}
 */
export function layered(nodes, edges) {
  const byName = new Map(nodes.map((node) => [node.name, { ...node, out: [], in: [], layer: -1 }]));
  const back = backEdges(byName, edges);
  const forward = edges
    .map((edge, number) => ({
      ...edge,
      ...(back.has(number) ? { from: edge.to, to: edge.from } : {}),
      number,
    }))
    .filter((edge) => edge.from !== edge.to);
  for (const edge of forward) {
    byName.get(edge.from).out.push(edge);
    byName.get(edge.to).in.push(edge);
  }
  rank(byName);
  const layers = [];
  const put = (node) => {
    (layers[node.layer] ??= []).push(node);
  };
  for (const node of byName.values()) put(node);
  for (let at = 0; at < layers.length; at++) layers[at] ??= [];

  // long edges go through places of their own
  const chains = new Map();
  for (const edge of forward) {
    const from = byName.get(edge.from),
      to = byName.get(edge.to),
      chain = [from];
    const middle = from.layer + 2 * Math.floor((to.layer - from.layer) / 4) + 1;
    for (let layer = from.layer + 1; layer < to.layer; layer++) {
      const labelled = layer === middle;
      const place = {
        name: null,
        width: labelled ? Math.max(edge.width, 12) : 12,
        height: labelled ? edge.height : 0,
        layer,
        isLabel: labelled,
      };
      layers[layer].push(place);
      chain.push(place);
    }
    chain.push(to);
    chains.set(edge.number, chain);
  }
  for (const layer of layers)
    for (const node of layer) {
      node.above = [];
      node.below = [];
    }
  for (const chain of chains.values())
    for (let at = 1; at < chain.length; at++) {
      chain[at - 1].below.push(chain[at]);
      chain[at].above.push(chain[at - 1]);
    }
  order(layers);
  const width = place(layers);
  let top = 0;
  for (const layer of layers) {
    const high = Math.max(0, ...layer.map((node) => node.height));
    for (const node of layer) node.y = top + high / 2;
    top += high + GAP_Y;
  }
  const ways = edges.map((edge, number) => {
    if (edge.from === edge.to) {
      const { x: middle, y, width: wide } = byName.get(edge.from),
        x = middle + wide / 2;
      return {
        path: [
          { x, y: y - 8 },
          { x: x + 26, y: y - 14 },
          { x: x + 26, y: y + 14 },
          { x, y: y + 8 },
        ],
        label: { x: x + 26 + edge.width / 2, y },
      };
    }
    const chain = chains.get(number);
    const path = chain.map((node, at) => ({
      x: node.x,
      y: node.y + (at === 0 ? node.height / 2 : at === chain.length - 1 ? -node.height / 2 : 0),
    }));
    return { path: back.has(number) ? path.reverse() : path, label: chain.find((node) => node.isLabel) };
  });
  return { width, height: Math.max(0, top - GAP_Y), nodes: byName, edges: ways };
}

/** Numbers of the edges that close a circle. */
function backEdges(byName, edges) {
  const out = new Map([...byName.keys()].map((name) => [name, []]));
  const comesIn = new Set();
  edges.forEach((edge, number) => {
    out.get(edge.from).push([edge.to, number]);
    if (edge.from !== edge.to) comesIn.add(edge.to);
  });
  const found = new Set(),
    state = new Map();
  const starts = [...byName.keys()].sort((a, b) => comesIn.has(a) - comesIn.has(b));
  for (const start of starts) {
    if (state.has(start)) continue;
    const stack = [[start, 0]];
    state.set(start, "open");
    while (stack.length) {
      const top = stack[stack.length - 1],
        next = out.get(top[0])[top[1]++];
      if (!next) {
        state.set(top[0], "done");
        stack.pop();
        continue;
      }
      if (state.get(next[0]) === "open") found.add(next[1]);
      else if (!state.has(next[0])) {
        state.set(next[0], "open");
        stack.push([next[0], 0]);
      }
    }
  }
  return found;
}

/** The longest way from a start gives the layer. */
function rank(byName) {
  const left = new Map([...byName.values()].map((node) => [node, node.in.length]));
  const ready = [...byName.values()].filter((node) => !node.in.length);
  for (const node of ready) node.layer = 0;
  while (ready.length) {
    const node = ready.shift();
    for (const edge of node.out) {
      const next = byName.get(edge.to);
      next.layer = Math.max(next.layer, node.layer + 2);
      left.set(next, left.get(next) - 1);
      if (!left.get(next)) ready.push(next);
    }
  }
}

/** Reduce crossings: each node goes to the median of its neighbours, down and up in turn. */
function order(layers) {
  for (let sweep = 0; sweep < SWEEPS; sweep++) {
    const down = sweep % 2 === 0;
    for (const layer of layers)
      layer.forEach((node, at) => {
        node.at = at;
      });
    for (const layer of down ? layers : [...layers].reverse()) {
      for (const node of layer) {
        const near = (down ? node.above : node.below).map((each) => each.at).sort((a, b) => a - b);
        node.key = near.length ? (near[(near.length - 1) >> 1] + near[near.length >> 1]) / 2 : node.at;
      }
      layer.sort((a, b) => a.key - b.key);
      layer.forEach((node, at) => {
        node.at = at;
      });
    }
  }
}

/** Give each node its x: near its neighbours, without touching the one beside it. Returns the width. */
function place(layers) {
  for (const layer of layers) {
    let x = 0;
    for (const node of layer) {
      node.x = x + node.width / 2;
      x += node.width + GAP_X;
    }
  }
  const widest = Math.max(
    0,
    ...layers.map((layer) =>
      layer.length ? layer[layer.length - 1].x + layer[layer.length - 1].width / 2 : 0,
    ),
  );
  for (const layer of layers) {
    const last = layer[layer.length - 1],
      shift = last ? (widest - last.x - last.width / 2) / 2 : 0;
    for (const node of layer) node.x += shift;
  }
  for (let sweep = 0; sweep < SWEEPS; sweep++) {
    for (const layer of sweep % 2 ? [...layers].reverse() : layers) {
      for (const node of layer) {
        const near = [...node.above, ...node.below];
        node.wish = near.length ? near.reduce((sum, each) => sum + each.x, 0) / near.length : node.x;
      }
      for (const node of layer) node.x = node.wish;
      apart(layer);
    }
  }
  const all = layers.flat(),
    least = Math.min(...all.map((node) => node.x - node.width / 2));
  for (const node of all) node.x -= least;
  return Math.max(0, ...all.map((node) => node.x + node.width / 2));
}

/** Push neighbours of a layer apart, to both sides alike. */
function apart(layer) {
  for (let pass = 0; pass < 12; pass++) {
    let moved = false;
    for (let at = 1; at < layer.length; at++) {
      const a = layer[at - 1],
        b = layer[at],
        lack = (a.width + b.width) / 2 + GAP_X - (b.x - a.x);
      if (lack > 0.5) {
        a.x -= lack / 2;
        b.x += lack / 2;
        moved = true;
      }
    }
    if (!moved) return;
  }
  for (let at = 1; at < layer.length; at++) {
    const a = layer[at - 1],
      b = layer[at];
    b.x = Math.max(b.x, a.x + (a.width + b.width) / 2 + GAP_X);
  }
}
