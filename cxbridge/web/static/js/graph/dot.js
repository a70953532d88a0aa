// Reads the part of the dot language that Skillers and the blackboard write: nodes, edges, attributes, subgraphs.
const TOKEN = /"((?:\\.|[^"\\])*)"|(->|[{}[\];,=])|([^\s"{}[\];,=]+)/gs;

export class DotError extends Error {}

/** @returns {nodes: Map name -> {name, label, ...attributes}, edges: [{from, to, ...attributes}], attributes} */
export function parseDot(text) {
  const tokens = [...text.matchAll(TOKEN)].map((match) => (match[2] ? { sign: match[2] } : { word: match[1] !== undefined ? match[1].replaceAll('\\"', '"') : match[3] }));
  let at = 0;
  const graph = { nodes: new Map(), edges: [], attributes: {} };
  const sign = (wanted) => tokens[at] && tokens[at].sign === wanted && Boolean(++at);
  function word() {
    if (!tokens[at] || tokens[at].word === undefined) throw new DotError("The graph is cut off or is none");
    return tokens[at++].word;
  }
  function attributes() {
    const found = {};
    while (sign("[")) {
      while (!sign("]")) {
        const name = word();
        found[name] = sign("=") ? word() : "true";
        sign(",") || sign(";");
      }
    }
    return found;
  }
  function node(name, more = {}) {
    if (!graph.nodes.has(name)) graph.nodes.set(name, { name, label: name });
    Object.assign(graph.nodes.get(name), more);
  }
  function body() {
    while (!sign("}")) {
      if (sign("{")) { body(); continue; }
      const name = word();
      if (name === "subgraph") { if (tokens[at] && tokens[at].word !== undefined) at++; if (!sign("{")) throw new DotError("The graph is cut off"); body(); }
      else if (sign("=")) graph.attributes[name] = word();
      else if (sign("->")) {
        const path = [name, word()];
        while (sign("->")) path.push(word());
        const more = attributes();
        for (let step = 1; step < path.length; step++) {
          node(path[step - 1]);
          node(path[step]);
          graph.edges.push({ ...more, from: path[step - 1], to: path[step] });
        }
      } else {
        const more = attributes();
        if (name === "graph" || name === "node" || name === "edge") { if (name === "graph") Object.assign(graph.attributes, more); }
        else node(name, more);
      }
      sign(";");
    }
  }
  sign("");
  if (word() !== "digraph") throw new DotError("This is no graph");
  if (!sign("{")) { word(); if (!sign("{")) throw new DotError("The graph is cut off"); }
  body();
  return graph;
}
