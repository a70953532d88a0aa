// Elements, with the helpers that the pages about recorded runs have too (shared/base.js).
export const { badge, visible } = cx;
export const el = (tag, attributes, ...children) => cx.el(tag, attributes, ...children.flat(Infinity));
export const svg = (tag, attributes, ...children) => cx.svg(tag, attributes, ...children.flat(Infinity));

export const button = (text, call, attributes = {}) =>
  el("button", { type: "button", ...attributes, on: { click: call } }, text);

/** Names and values below each other; pairs without value are left out. */
export function pairs(entries) {
  const rows = entries.filter(
    ([, value]) => value !== "" && value !== undefined && value !== null && value.length !== 0,
  );
  return el(
    "dl",
    { class: "pairs" },
    rows.map(([name, value]) => [el("dt", {}, name), el("dd", {}, value)]),
  );
}

/** A table. @param heads texts, or cells that are made already; none: no line of heads */
export const dataTable = (attributes, heads, rows) =>
  el(
    "table",
    attributes,
    heads.length
      ? el(
          "thead",
          {},
          el(
            "tr",
            {},
            heads.map((head) => (head instanceof Node ? head : el("th", { scope: "col" }, head))),
          ),
        )
      : null,
    el("tbody", {}, rows),
  );

/** A table that scrolls by itself where there is little room. */
export const wideTable = (attributes, heads, rows) =>
  el("div", { class: "wide" }, dataTable(attributes, heads, rows));

export const none = (text, hint) =>
  el("div", { class: "empty" }, el("p", {}, text), hint ? el("p", { class: "dim" }, hint) : null);

/** A panel with a title and, at its right, tools. */
export function panel(title, tools, ...children) {
  return el(
    "section",
    { class: "panel" },
    el("div", { class: "panel-head" }, el("h2", {}, title), el("div", { class: "tools" }, tools)),
    ...children,
  );
}

/** Tabs as links; `current` is the one that is shown. */
export function tabs(label, entries, current) {
  return el(
    "nav",
    { class: "tabs", "aria-label": label },
    entries.map(([href, text]) => el("a", { href, "aria-current": href === current ? "page" : null }, text)),
  );
}

const SAY_MS = 700;
/** Announced to screen readers, when somebody has typed; not with each change of what is shown. */
function sayCount(input) {
  const count = input.isConnected && input.closest(".panel-head").querySelector(".count");
  if (count && count.textContent) document.getElementById("said").textContent = count.textContent + " shown";
}

export function search(label, call) {
  const input = el("input", {
    type: "search",
    class: "find",
    placeholder: label + "  /",
    "aria-label": label,
    spellcheck: "false",
    autocomplete: "off",
  });
  let timer = null;
  input.addEventListener("input", () => {
    call(input.value.trim().toLowerCase());
    clearTimeout(timer);
    timer = setTimeout(() => sayCount(input), SAY_MS);
  });
  return input;
}

export function checkbox(text, checked, call) {
  const box = el("input", { type: "checkbox", checked });
  box.addEventListener("change", () => call(box.checked));
  return el("label", { class: "check" }, box, " ", text);
}

const pad = (number, width = 2) => String(number).padStart(width, "0");

const BY_DAY = "cxbridge.time-of-day";
const moments = { zero: null, byDay: false };
try {
  moments.byDay = localStorage.getItem(BY_DAY) === "yes";
} catch {
  // a page in a sandbox has no storage
}

/** Times count from here: where the run began, microseconds since the epoch; null: that is not known. */
export const countFrom = (begin) => {
  moments.zero = begin;
};
/** What times count from; null: the time of day is shown. */
export const zeroOfTimes = () => (moments.byDay ? null : moments.zero);
/** Show the time of day, or seconds into the run again. */
export function switchTimes() {
  moments.byDay = !moments.byDay;
  localStorage.setItem(BY_DAY, moments.byDay ? "yes" : "no");
}

/** Microseconds since the epoch as seconds into the run, or as the time of day where that is wanted. */
export function clockText(timeUs, digits = 0) {
  const zero = zeroOfTimes();
  return zero === null ? timeOfDay(timeUs, digits) : ((timeUs - zero) / 1e6).toFixed(digits || 1) + " s";
}

/** The time of day of microseconds since the epoch. */
export function timeOfDay(timeUs, digits = 0) {
  const date = new Date(timeUs / 1000);
  const text = pad(date.getHours()) + ":" + pad(date.getMinutes()) + ":" + pad(date.getSeconds());
  return digits ? text + "." + pad(Math.floor((timeUs / 10 ** (6 - digits)) % 10 ** digits), digits) : text;
}

export function durationText(us) {
  if (us < 1e6) return Math.round(us / 1e3) + " ms";
  if (us < 60e6) return (us / 1e6).toFixed(1) + " s";
  return Math.floor(us / 60e6) + " min " + Math.floor((us % 60e6) / 1e6) + " s";
}

/** Replace what is in a node, and keep where it was scrolled to. */
export function refill(node, ...children) {
  const top = node.firstChild ? node.scrollTop : 0;
  node.replaceChildren(...children.flat().filter((child) => child !== null && child !== undefined));
  if (top) node.scrollTop = top; // to read or write it makes the browser lay out everything
}

const MANY = 2000,
  SLOWER_MS = 120,
  SHARE = 4; // of the time at most one part in as many is used
/**
 * Calls at once while there are few items, of many some eight times a second, and never so often that it is
 * most of what the page does.
 */
export function paced(call, size) {
  let timer = null,
    last = -Infinity,
    rest = 0;
  const run = () => {
    timer = null;
    const begin = performance.now();
    call();
    last = performance.now();
    rest = (last - begin) * SHARE;
  };
  const start = () => {
    if (timer !== null) return;
    const wait = last + Math.max(rest, size() > MANY ? SLOWER_MS : 0) - performance.now();
    if (wait > 0) timer = setTimeout(run, wait);
    else run();
  };
  start.stop = () => {
    clearTimeout(timer);
    timer = null;
  };
  return start;
}
