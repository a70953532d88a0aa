"use strict";
// What all pages share. `cx.data` is the page's data, `cx.el` makes elements (text is text, never markup).
const cx = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const outcomes = {/* outcomes */};
  const SVG = "http://www.w3.org/2000/svg";

  // controls come as escapes in the data and are shown by their number; the others are shown so already
  const visible = (text) => text.replace(/[\u0000-\u0008\u000b-\u001f]/g,
    (character) => "\\u" + character.charCodeAt(0).toString(16).padStart(4, "0"));

  function fill(node, attributes, children) {
    for (const [name, value] of Object.entries(attributes || {})) {
      if (value === undefined || value === null || value === false) continue;
      if (name === "on") for (const [event, call] of Object.entries(value)) node.addEventListener(event, call);
      else node.setAttribute(name, value === true ? "" : visible(String(value)));
    }
    for (const child of children.flat()) {
      if (child !== null && child !== undefined) node.append(typeof child === "string" ? visible(child) : child);
    }
    return node;
  }
  const el = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
  const svg = (tag, attributes, ...children) => fill(document.createElementNS(SVG, tag), attributes, children);
  const get = (id) => document.getElementById(id);

  // a state: icon and word, in its tone
  const badge = (tone, icon, text) => el("span", { class: "badge t-" + tone }, el("i", { "aria-hidden": "true" }, icon), text);

  // a tree as parts.goal_tree makes it: arrows walk, left and right close and open
  function walkTree(tree) {
    const rows = [...tree.children];
    const level = (row) => Number(row.getAttribute("aria-level"));
    const shown = () => rows.filter((row) => !row.hidden);
    function focus(row) {
      if (!row) return;
      for (const other of rows) other.tabIndex = -1;
      row.tabIndex = 0;
      row.focus();
    }
    function open(row, wanted) {
      row.setAttribute("aria-expanded", String(wanted));
      const closed = [];  // levels of closed rows above the one looked at
      for (const each of rows) {
        while (closed.length && closed[closed.length - 1] >= level(each)) closed.pop();
        each.hidden = closed.length > 0;
        if (each.getAttribute("aria-expanded") === "false") closed.push(level(each));
      }
    }
    const parent = (row) => rows.slice(0, rows.indexOf(row)).reverse().find((each) => level(each) < level(row));
    tree.addEventListener("keydown", (event) => {
      const row = event.target.closest("[role=treeitem]");
      if (!row || event.ctrlKey || event.metaKey || event.altKey) return;
      const list = shown(), at = list.indexOf(row), state = row.getAttribute("aria-expanded");
      if (event.key === "ArrowDown") focus(list[at + 1]);
      else if (event.key === "ArrowUp") focus(list[at - 1]);
      else if (event.key === "Home") focus(list[0]);
      else if (event.key === "End") focus(list[list.length - 1]);
      else if (event.key === "ArrowLeft") { if (state === "true") open(row, false); else focus(parent(row)); }
      else if (event.key === "ArrowRight") { if (state === "false") open(row, true); else focus(list[at + 1]); }
      else if (event.key === "Enter" || event.key === " ") { if (state) open(row, state === "false"); }
      else return;
      event.preventDefault();
    });
    tree.addEventListener("click", (event) => {
      const row = event.target.closest("[role=treeitem]");
      if (!row) return;
      const state = row.getAttribute("aria-expanded");
      if (state && event.offsetX < row.firstElementChild.offsetLeft - row.offsetLeft) open(row, state === "false");
      focus(row);
    });
    if (rows.length) rows[0].tabIndex = 0;
  }
  document.querySelectorAll("ul.tree").forEach(walkTree);
  return { data, outcomes, el, svg, get, badge, visible };
})();
