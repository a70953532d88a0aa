// Makers of elements and of the controls that views share, and the texts of times. base.js, which all pages
// load, has the makers without selectors.
export const { badge } = cx;
/** Whether an argument is an object of attributes: not a node, an array or a text. */
const isAttributes = (value) => Object.getPrototypeOf(value ?? "") === Object.prototype;

/**
 * `el.li(...)` and `el("li#id.class", ...)` make elements. The arguments are an object of attributes, which
 * may be left out, and the children.
 */
function maker(make) {
  const build = (selector, ...content) => {
    const [, tag, id, classes] = /^([\w-]+)(?:#([\w-]+))?((?:\.[\w-]+)*)$/.exec(selector),
      [attributes, children] = isAttributes(content[0]) ? [content[0], content.slice(1)] : [{}, content],
      selected = { ...(id && { id }), ...(classes && { class: classes.slice(1).replaceAll(".", " ") }) };
    return make(tag, { ...attributes, ...selected }, ...children.flat(Infinity));
  };
  return new Proxy(build, { get: (_, tag) => build.bind(null, tag) });
}
export const el = maker(cx.el);
export const svg = maker(cx.svg);

export const link = (href, ...children) => el.a({ href }, ...children);
export const dim = (...children) => el("span.dim", ...children);
export const note = (...children) => el("p.dim", ...children);
export const button = (text, onClick, attributes = {}) =>
  el.button({ type: "button", ...attributes, on: { click: onClick } }, text);
export const submit = (text, attributes = {}) =>
  el.button({ type: "submit", class: "primary", ...attributes }, text);
export const backLink = (href, to) => el("a.back", { href, "aria-label": "back to the " + to }, "←");

// names and skill strings are not prose, so the browser must not correct them
const VERBATIM = { type: "text", spellcheck: "false", autocomplete: "off", autocapitalize: "off" };
export const textInput = (attributes) => el.input({ ...VERBATIM, ...attributes });
export const field = (label, input) => el.label(el.span(label), input);

/** A form that calls a function when the user submits it, in place of the browser's request. */
export function form(selector, submitted, ...children) {
  const onSubmit = (event) => {
    event.preventDefault();
    submitted();
  };
  return el("form" + selector, { on: { submit: onSubmit } }, ...children);
}

/**
 * The submit button of a form that changes the daemon's state; with a reason while the button is disabled.
 */
export const gatedSubmit = (app, text) =>
  el("div.tools", app.gate(submit(text)), app.whyNot && el("span.dim.small", app.whyNot));

/** A list of names and values; pairs without a value are left out. */
export const pairs = (entries) =>
  el(
    "dl.pairs",
    entries
      .filter(([, value]) => ![value ?? ""].flat().every((part) => part === ""))
      .map(([name, value]) => [el.dt(name), el.dd(value)]),
  );

/**
 * A table that scrolls by itself where there is little room.
 * @param heads texts or cells of the head; [] for a table without a head
 * @param rows elements, or lists of cells: texts, numbers, elements
 * @param numbers the indices of columns with numbers
 */
export const wideTable = (attributes, heads, rows, numbers = []) =>
  el("div.wide", dataTable(attributes, heads, rows, numbers));

/** A table; see wideTable() for the parameters. */
export function dataTable(attributes, heads, rows, numbers = []) {
  const classOf = (column) => (numbers.includes(column) ? "n" : null),
    isCell = (node) => node instanceof Element && /^t[dh]$/i.test(node.tagName);
  const head = (content, column) =>
    isCell(content) ? content : el.th({ scope: "col", class: classOf(column) }, content);
  const cell = (content, column) => (isCell(content) ? content : el.td({ class: classOf(column) }, content));
  return el.table(
    attributes,
    heads.length > 0 && el.thead(el.tr(heads.map(head))),
    el.tbody(rows.map((row) => (Array.isArray(row) ? el.tr(row.map(cell)) : row))),
  );
}

/** The text in place of an empty list, and a hint below it. */
export const none = (text, hint) => el("div.empty", el.p(text), hint ? note(hint) : null);

/**
 * A titled list, with the number of items that it leaves out; null without items.
 * @param entry(item) the content of an item
 * @param options most: the greatest number of shown items; isLatest: show the last items, not the first
 */
export function listSection(title, items, entry, { most, className = null, isLatest = false }) {
  const shown = isLatest ? items.slice(-most) : items.slice(0, most),
    more = items.length - shown.length,
    entries = shown.map((item) => el.li({ class: className }, entry(item)));
  if (!items.length) return null;
  return el.section(
    el.h3(title),
    el("ul.tl-list", entries, more > 0 && el("li.dim", "and " + more + " more")),
  );
}

/** A panel with a title and, at its right, tools. */
export const panel = (title, tools, ...children) =>
  el("section.panel", el("div.panel-head", el.h2(title), el("div.tools", tools)), ...children);

/** Tabs as links. @param entries pairs of address and text @param current the address of the open tab */
export const tabs = (label, entries, current) =>
  el(
    "nav.tabs",
    { "aria-label": label },
    entries.map(([href, text]) => el.a({ href, "aria-current": href === current ? "page" : null }, text)),
  );

const SAY_MS = 700; // the pause of typing after which a count is announced
/** Announce the number of found items to screen readers after a search; not after each change of the list. */
function sayCount(input) {
  const count = input.isConnected && input.closest(".panel-head").querySelector(".count");
  if (count && count.textContent) document.getElementById("said").textContent = count.textContent + " shown";
}

/**
 * The search field of a list; the page's key `/` selects it.
 * @param onSearch(text) gets the text in lower case
 */
export function search(label, onSearch) {
  const input = textInput({ type: "search", class: "find", placeholder: label + "  /", "aria-label": label });
  let timer = null;
  input.addEventListener("input", () => {
    onSearch(input.value.trim().toLowerCase());
    clearTimeout(timer);
    timer = setTimeout(() => sayCount(input), SAY_MS);
  });
  return input;
}

export function checkbox(text, checked, onChange, attributes = {}) {
  const box = el.input({ type: "checkbox", checked, on: { change: () => onChange(box.checked) } });
  return el("label.check", attributes, box, " ", text);
}

/**
 * A choice among options. Its method `offer` sets the options, texts or pairs of value and text, and the
 * chosen value.
 * @param changed(value) called when the user chooses
 */
export function choice(attributes, changed) {
  const select = el.select({ ...attributes, on: { change: () => changed(select.value) } });
  select.offer = (options, chosen) =>
    redraw(select, [options, chosen], () =>
      options.map((option) => {
        const [value, text] = Array.isArray(option) ? option : [option, option];
        return el.option({ value, selected: value === chosen }, text);
      }),
    );
  return select;
}

export const pad = (number, width = 2) => String(number).padStart(width, "0");

// the key under which the browser keeps whether times are times of day
const BY_DAY_KEY = "cxbridge.time-of-day";
/** The value that the browser keeps under a key; null without one, and where a sandbox has no storage. */
export function remembered(key) {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}
export function remember(key, value) {
  try {
    localStorage.setItem(key, value);
  } catch {
    // the value holds until the page is loaded again
  }
}
const timeDisplay = { zero: null, byDay: remembered(BY_DAY_KEY) === "yes" };

/** Set the begin of the run, from which times count, in microseconds since the epoch; null: unknown. */
export const countFrom = (begin) => {
  timeDisplay.zero = begin;
};
/** The moment from which times count; null: the page shows times of day. */
export const zeroOfTimes = () => (timeDisplay.byDay ? null : timeDisplay.zero);
/** Switch between times of day and seconds into the run. */
export function switchTimes() {
  timeDisplay.byDay = !timeDisplay.byDay;
  remember(BY_DAY_KEY, timeDisplay.byDay ? "yes" : "no");
}

/** The text of a time: seconds into the run, or the time of day. @param digits decimal digits of a second */
export function clockText(timeUs, digits = 0) {
  const zero = zeroOfTimes();
  return zero === null ? timeOfDay(timeUs, digits) : ((timeUs - zero) / 1e6).toFixed(digits || 1) + " s";
}

/** The text of seconds into a run. */
export const secondsText = (seconds) => seconds.toFixed(3) + " s";

/** The text of a time of day. @param digits decimal digits of a second */
export function timeOfDay(timeUs, digits = 0) {
  const date = new Date(timeUs / 1000);
  const text = [date.getHours(), date.getMinutes(), date.getSeconds()].map((part) => pad(part)).join(":");
  return digits ? text + "." + pad(Math.floor((timeUs / 10 ** (6 - digits)) % 10 ** digits), digits) : text;
}

/** The text of a duration in microseconds. */
export function durationText(us) {
  if (us < 1e6) return Math.round(us / 1e3) + " ms";
  if (us < 60e6) return (us / 1e6).toFixed(1) + " s";
  return Math.floor(us / 60e6) + " min " + Math.floor((us % 60e6) / 1e6) + " s";
}

export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
export const plural = (count, noun) => count + " " + noun + (count === 1 ? "" : "s");

/** Replace the children of a node, and keep its scroll position. */
export function refill(node, ...children) {
  const top = node.firstChild ? node.scrollTop : 0,
    isShown = (child) => child !== null && child !== undefined && child !== false && child !== "";
  node.replaceChildren(...children.flat(Infinity).filter(isShown));
  if (top) node.scrollTop = top; // reading or writing scrollTop makes the browser lay out the page
}

const states = new WeakMap(); // node -> the state that the node shows, as JSON
/**
 * Refill a node if the state differs from the shown state. Returns whether it did.
 * @param make() the new children; without `make`, the state is forgotten, and the next call refills the node
 */
export function redraw(node, state, make) {
  const stateJson = make && JSON.stringify(state);
  if (stateJson !== undefined && states.get(node) === stateJson) return false;
  states.set(node, stateJson);
  if (make) refill(node, make());
  return true;
}

const MANY_ITEMS = 2000,
  MIN_INTERVAL_MS = 120, // the shortest time between two calls for many items
  REST_FACTOR = 4; // the time between two calls, as a multiple of the duration of a call
/**
 * Return a function that calls `draw`: at once for few items, about eight times a second for
 * many items, and for at most a fifth of the time. `stop` of the function cancels a planned call.
 * @param size() the number of items
 */
export function paced(draw, size) {
  let timer = null,
    endedAt = -Infinity,
    restMs = 0;
  const run = () => {
    timer = null;
    const begin = performance.now();
    draw();
    endedAt = performance.now();
    restMs = (endedAt - begin) * REST_FACTOR;
  };
  const start = () => {
    if (timer !== null) return;
    const waitMs = endedAt + Math.max(restMs, size() > MANY_ITEMS ? MIN_INTERVAL_MS : 0) - performance.now();
    if (waitMs > 0) timer = setTimeout(run, waitMs);
    else run();
  };
  start.stop = () => {
    clearTimeout(timer);
    timer = null;
  };
  return start;
}
