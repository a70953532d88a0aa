// Texts with links for moments and the names of goals, rules and facts.
import { escapePart } from "cx/api.js";
import { el } from "cx/dom.js";

// a name, with #2 behind an id that is used again; or a time
const WORD = /[A-Za-z_][\w-]*(?:#\d+)?|\b\d+\.\d{3} s\b/g;
// "rule NAME", and each name in "rules that could do so: NAME, NAME"; not "for a rule that selects it"
const BEFORE_RULE = /(?<!\b(a|no|other) )\brule $|\brules that could do so: ([^\s,]+, )*$/;

/** Put links into a text. @param rules the known rule names, a Set @returns nodes and texts */
export function linked(app, text, rules = new Set()) {
  const parts = [];
  let at = 0;
  for (const match of text.matchAll(WORD)) {
    const [word] = match,
      isRule = rules.has(word) || BEFORE_RULE.test(text.slice(0, match.index));
    let href = "";
    if (/^f-\d+$/.test(word)) href = "#/clips/facts/" + word;
    else if (app.model.goals.has(word) || app.model.gone.has(word))
      href = (location.hash.startsWith("#/timeline") ? "#/timeline/goal/" : "#/goals/") + escapePart(word);
    else if (isRule) href = "#/clips/rules/" + escapePart(word);
    else if (/^\d/.test(word) && app.zero !== null)
      href = "#/timeline?time=" + Math.round(app.zero + parseFloat(word) * 1e6);
    if (!href) continue;
    parts.push(text.slice(at, match.index), el.a({ href }, word));
    at = match.index + word.length;
  }
  parts.push(text.slice(at));
  return parts.filter((linkOrText) => linkOrText !== "");
}
