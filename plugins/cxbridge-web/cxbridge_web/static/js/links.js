// Text in which the names of goals, rules and facts are links to them.
import { part } from "cx/api.js";
import { el } from "cx/dom.js";

const WORD = /[A-Za-z_][\w-]*(?:#\d+)?/g;

/**
 * @param rules names of rules that are known, a Set
 * @returns nodes and texts
 */
export function linked(app, text, rules = new Set()) {
  const found = [];
  let at = 0;
  for (const match of text.matchAll(WORD)) {
    const [word] = match;
    const href = /^f-\d+$/.test(word)
      ? "#/clips/facts/" + word
      : app.model.goals.has(word) || app.model.gone.has(word)
        ? "#/goals/" + part(word)
        : rules.has(word)
          ? "#/clips/rules/" + part(word)
          : "";
    if (!href) continue;
    found.push(text.slice(at, match.index), el("a", { href }, word));
    at = match.index + word.length;
  }
  found.push(text.slice(at));
  return found.filter((each) => each !== "");
}
