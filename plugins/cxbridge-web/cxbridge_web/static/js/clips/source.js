// The text of CLIPS constructs: found in files, and shown with colours.
import { el } from "cx/dom.js";

const TOKEN = /;[^\n]*|"(?:\\.|[^"\\])*"|\$?\?[\w-]*|\?\*[\w-]+\*|[()]|[^\s()";]+|\s+/gs;
const CONSTRUCT = /^def\w+$/;
const WORDS = new Set(
  "not and or exists forall logical test declare if then else while do bind modify assert retract duplicate printout return loop-for-count progn$ do-for-all-facts delayed-do-for-all-facts do-for-fact any-factp slot multislot default type salience".split(
    " ",
  ),
);

function kindOf(token, isHead) {
  if (token.startsWith(";")) return "comment";
  if (token.startsWith('"')) return "string";
  if (/^(\$?\?|\?\*)/.test(token)) return "variable";
  if (/^[+-]?\d+(\.\d+)?$/.test(token)) return "number";
  if (token === "=>" || token === "<-") return "arrow";
  if (isHead && (CONSTRUCT.test(token) || WORDS.has(token))) return "keyword";
  return isHead && /^[\w-]+$/.test(token) ? "head" : "";
}

/** CLIPS text as nodes with colours; all of the text is there. */
export function highlighted(text) {
  const nodes = [];
  let isHead = false,
    plain = "";
  for (const [token] of text.matchAll(TOKEN)) {
    const kind = /^\s/.test(token) ? "" : kindOf(token, isHead);
    if (!/^\s/.test(token)) isHead = token === "(";
    if (!kind) {
      plain += token;
      continue;
    }
    if (plain) nodes.push(plain);
    plain = "";
    nodes.push(el.span({ class: "s-" + kind }, token));
  }
  if (plain) nodes.push(plain);
  return nodes;
}

/** The constructs of a file: {construct, name, line, text}. */
export function constructsOf(text) {
  const found = [];
  let depth = 0,
    begin = 0,
    line = 1,
    beginLine = 1;
  for (const match of text.matchAll(TOKEN)) {
    const [token] = match;
    if (token === "(") {
      if (!depth) {
        begin = match.index;
        beginLine = line;
      }
      depth += 1;
    } else if (token === ")" && depth) {
      depth -= 1;
      if (!depth) {
        const whole = text.slice(begin, match.index + 1),
          head = /^\(\s*(def\w+)\s+(?:[\w-]+::)?([^\s()]+)/.exec(whole);
        if (head) found.push({ construct: head[1], name: head[2], line: beginLine, text: whole });
      }
    }
    for (const character of token) if (character === "\n") line += 1;
  }
  return found;
}
