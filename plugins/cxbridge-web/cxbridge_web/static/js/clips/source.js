// The text of CLIPS constructs: found in files, and shown with colours.
import { el } from "cx/dom.js";

const TOKEN = /;[^\n]*|"(?:\\.|[^"\\])*"|\$?\?[\w-]*|\?\*[\w-]+\*|[()]|[^\s()";]+|\s+/gs;
const KEYWORD =
  /^(def\w+|not|and|or|exists|forall|logical|test|declare|if|then|else|while|do|bind|modify|assert|retract|duplicate|printout|return|loop-for-count|progn\$|(delayed-)?do-for-(all-facts|fact)|any-factp|(multi)?slot|default|type|salience)$/;
const KINDS = [
  ["comment", /^;/],
  ["string", /^"/],
  ["variable", /^(\$?\?|\?\*)/],
  ["number", /^[+-]?\d+(\.\d+)?$/],
  ["arrow", /^(=>|<-)$/],
];
const HEADS = [
  ["keyword", KEYWORD],
  ["head", /^[\w-]+$/],
];

/** CLIPS text as nodes with colours; all of the text is there. */
export function highlighted(text) {
  let isHead = false;
  return [...text.matchAll(TOKEN)].map(([token]) => {
    if (/^\s/.test(token)) return token;
    const [kind] = [...KINDS, ...(isHead ? HEADS : [])].find(([, shape]) => shape.test(token)) || [];
    isHead = token === "(";
    return kind ? el.span({ class: "s-" + kind }, token) : token;
  });
}

/** The constructs of a file: {construct, name, line, text}. */
export function constructsOf(text) {
  const found = [];
  let depth = 0,
    begin = 0,
    line = 1,
    beginLine = 1;
  for (const { 0: token, index } of text.matchAll(TOKEN)) {
    if (token === "(" && !depth++) [begin, beginLine] = [index, line];
    if (token === ")" && depth && !--depth) {
      const whole = text.slice(begin, index + 1),
        head = /^\(\s*(def\w+)\s+(?:[\w-]+::)?([^\s()]+)/.exec(whole);
      if (head) found.push({ construct: head[1], name: head[2], line: beginLine, text: whole });
    }
    line += token.split("\n").length - 1;
  }
  return found;
}
