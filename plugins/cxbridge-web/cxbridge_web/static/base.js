"use strict";
// What all pages share. `cx.el` makes elements (text is text, never markup).
const cx = (() => {
  const outcomes = OUTCOMES_OF_CXBRIDGE;
  const SVG = "http://www.w3.org/2000/svg";

  // characters that are not seen, or turn the reading order around, are shown by their number
  const UNSEEN =
    /[\u0000-\u0008\u000b-\u001f\u007f-\u009f\u00ad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb\p{Cs}\u{e0000}-\u{e007f}]/gu;
  const numbered = (character) => {
    const code = character.codePointAt(0),
      [mark, digits] = code < 0x10000 ? ["\\u", 4] : ["\\U", 8];
    return mark + code.toString(16).padStart(digits, "0");
  };
  const visible = (text) => text.replace(UNSEEN, numbered);

  function fill(node, attributes, children) {
    for (const [name, value] of Object.entries(attributes || {})) {
      if (value === undefined || value === null || value === false) continue;
      if (name === "on")
        for (const [event, call] of Object.entries(value)) node.addEventListener(event, call);
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

  // a state: icon and word, in its tone
  const badge = (tone, icon, text) =>
    el("span", { class: "badge t-" + tone }, el("i", { "aria-hidden": "true" }, icon), text);

  return { outcomes, el, svg, badge, visible };
})();
