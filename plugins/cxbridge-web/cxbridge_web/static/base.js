"use strict";
// The helpers of all pages, as the global `cx`. `cx.el` makes elements; a text child is never read as markup.
const cx = (() => {
  const outcomes = OUTCOMES_OF_CXBRIDGE; // pages.py puts the JSON of cxbridge/history/outcome.py here
  const SVG = "http://www.w3.org/2000/svg";

  // Invisible characters, and characters that reverse the reading order; cxbridge_web/escaping.py has the
  // same.
  const INVISIBLE =
    /[\u0000-\u0008\u000b-\u001f\u007f-\u009f\u00ad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb\p{Cs}\u{e0000}-\u{e007f}]/gu;
  /** The number of a character as in Python: \u202e, or \U000e0001 beyond 16 bits. */
  const escaped = (character) => {
    const code = character.codePointAt(0),
      [prefix, digits] = code < 0x10000 ? ["\\u", 4] : ["\\U", 8];
    return prefix + code.toString(16).padStart(digits, "0");
  };
  /** A text with its invisible characters as escapes. */
  const visible = (text) => text.replace(INVISIBLE, escaped);

  /**
   * Set the attributes of a node and append its children; undefined, null and false are left out.
   * @param attributes values by name; true: an attribute without a value; `on`: listeners by event
   */
  function fill(node, attributes, children) {
    for (const [name, value] of Object.entries(attributes || {})) {
      if (value === undefined || value === null || value === false) continue;
      if (name === "on")
        for (const [event, listener] of Object.entries(value)) node.addEventListener(event, listener);
      else node.setAttribute(name, value === true ? "" : visible(String(value)));
    }
    for (const child of children.flat()) {
      if (child !== null && child !== undefined && child !== false)
        node.append(typeof child === "string" ? visible(child) : child);
    }
    return node;
  }
  const el = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
  const svg = (tag, attributes, ...children) =>
    fill(document.createElementNS(SVG, tag), attributes, children);

  /** A state as an icon and a word, in the colour of a tone: `t-TONE` in css/base.css. */
  const badge = (tone, icon, text) =>
    el("span", { class: "badge t-" + tone }, el("i", { "aria-hidden": "true" }, icon), text);

  return { outcomes, el, svg, badge, visible };
})();
