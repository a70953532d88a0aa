// Elements, with the helpers that the pages about recorded runs have too (base.js).
export const { badge } = cx;
const isAttributes = (value) => Object.getPrototypeOf(value ?? "") === Object.prototype;

/** `el.li(...)` and `el("li#id.class", ...)` make elements of attributes, if there are any, and children. */
function maker(make) {
  const build = (selector, ...rest) => {
    const [, tag, id, names] = /^([\w-]+)(?:#([\w-]+))?((?:\.[\w-]+)*)$/.exec(selector),
      [given, children] = isAttributes(rest[0]) ? [rest[0], rest.slice(1)] : [{}, rest],
      named = { ...(id && { id }), ...(names && { class: names.slice(1).replaceAll(".", " ") }) };
    return make(tag, { ...given, ...named }, ...children.flat(Infinity));
  };
  return new Proxy(build, { get: (_, tag) => build.bind(null, tag) });
}
export const el = maker(cx.el);
export const svg = maker(cx.svg);

export const link = (href, ...children) => el.a({ href }, ...children);
export const dim = (...children) => el("span.dim", ...children);
export const note = (...children) => el("p.dim", ...children);
export const button = (text, call, attributes = {}) =>
  el.button({ type: "button", ...attributes, on: { click: call } }, text);
export const submit = (text, attributes = {}) =>
  el.button({ type: "submit", class: "primary", ...attributes }, text);
export const backLink = (href, to) => el("a.back", { href, "aria-label": "back to the " + to }, "←");

// names and skill strings are no prose: nothing corrects them
const VERBATIM = { type: "text", spellcheck: "false", autocomplete: "off", autocapitalize: "off" };
export const textInput = (attributes) => el.input({ ...VERBATIM, ...attributes });
export const field = (label, input) => el.label(el.span(label), input);

/** A form that calls `done` in place of a request. */
export function form(selector, done, ...children) {
  const submitted = (event) => {
    event.preventDefault();
    done();
  };
  return el("form" + selector, { on: { submit: submitted } }, ...children);
}

/** The button of a form that changes something, with the reason why it is disabled. */
export const changeTools = (app, text) =>
  el("div.tools", app.gate(submit(text)), app.whyNot && el("span.dim.small", app.whyNot));

/** Names and values below each other; pairs without value are left out. */
export const pairs = (entries) =>
  el(
    "dl.pairs",
    entries
      .filter(([, value]) => ![value ?? ""].flat().every((each) => each === ""))
      .map(([name, value]) => [el.dt(name), el.dd(value)]),
  );

/**
 * A table that scrolls by itself where there is little room.
 * @param heads texts, or cells; without them there is no line of heads
 * @param rows elements, or lists of cells: texts, numbers, elements
 * @param numbers which columns are numbers
 */
export const wideTable = (attributes, heads, rows, numbers = []) =>
  el("div.wide", dataTable(attributes, heads, rows, numbers));

export function dataTable(attributes, heads, rows, numbers = []) {
  const kind = (at) => (numbers.includes(at) ? "n" : null),
    isCell = (node) => node instanceof Element && /^t[dh]$/i.test(node.tagName);
  const head = (each, at) => (isCell(each) ? each : el.th({ scope: "col", class: kind(at) }, each));
  const cell = (each, at) => (isCell(each) ? each : el.td({ class: kind(at) }, each));
  return el.table(
    attributes,
    heads.length > 0 && el.thead(el.tr(heads.map(head))),
    el.tbody(rows.map((row) => (Array.isArray(row) ? el.tr(row.map(cell)) : row))),
  );
}

export const none = (text, hint) => el("div.empty", el.p(text), hint ? note(hint) : null);

/** A titled list of at most so many items, with the number of the others; null without items. */
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

/** Tabs as links; `current` is the one that is shown. */
export const tabs = (label, entries, current) =>
  el(
    "nav.tabs",
    { "aria-label": label },
    entries.map(([href, text]) => el.a({ href, "aria-current": href === current ? "page" : null }, text)),
  );

const SAY_MS = 700;
/** Announce a count to screen readers after a search; not with each change of the list. */
function sayCount(input) {
  const count = input.isConnected && input.closest(".panel-head").querySelector(".count");
  if (count && count.textContent) document.getElementById("said").textContent = count.textContent + " shown";
}

export function search(label, call) {
  const input = textInput({ type: "search", class: "find", placeholder: label + "  /", "aria-label": label });
  let timer = null;
  input.addEventListener("input", () => {
    call(input.value.trim().toLowerCase());
    clearTimeout(timer);
    timer = setTimeout(() => sayCount(input), SAY_MS);
  });
  return input;
}

export function checkbox(text, checked, call, attributes = {}) {
  const box = el.input({ type: "checkbox", checked, on: { change: () => call(box.checked) } });
  return el("label.check", attributes, box, " ", text);
}

/** A choice: `offer` sets its options, texts or pairs of value and text, and the one that is chosen. */
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

const BY_DAY = "cxbridge.time-of-day";
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
const moments = { zero: null, byDay: remembered(BY_DAY) === "yes" };

/** Times count from here: where the run began, microseconds since the epoch; null: that is not known. */
export const countFrom = (begin) => {
  moments.zero = begin;
};
/** What times count from; null: the time of day is shown. */
export const zeroOfTimes = () => (moments.byDay ? null : moments.zero);
/** Show the time of day, or seconds into the run again. */
export function switchTimes() {
  moments.byDay = !moments.byDay;
  remember(BY_DAY, moments.byDay ? "yes" : "no");
}

/** Microseconds since the epoch as seconds into the run, or as the time of day where that is wanted. */
export function clockText(timeUs, digits = 0) {
  const zero = zeroOfTimes();
  return zero === null ? timeOfDay(timeUs, digits) : ((timeUs - zero) / 1e6).toFixed(digits || 1) + " s";
}

/** Seconds into a run. */
export const secondsText = (seconds) => seconds.toFixed(3) + " s";

/** The time of day of microseconds since the epoch. */
export function timeOfDay(timeUs, digits = 0) {
  const date = new Date(timeUs / 1000);
  const text = [date.getHours(), date.getMinutes(), date.getSeconds()].map((part) => pad(part)).join(":");
  return digits ? text + "." + pad(Math.floor((timeUs / 10 ** (6 - digits)) % 10 ** digits), digits) : text;
}

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

const states = new WeakMap(); // node -> what it shows, as JSON
/** Refill a node if the state differs from the last one. Without `make` the next call refills in any case. */
export function redraw(node, state, make) {
  const sign = make && JSON.stringify(state);
  if (sign !== undefined && states.get(node) === sign) return false;
  states.set(node, sign);
  if (make) refill(node, make());
  return true;
}

const MANY = 2000,
  SLOWER_MS = 120,
  SHARE = 4; // a call rests for so many times its duration
/**
 * Limit a call that draws: at once for few items, some eight times a second for many, and never most of the
 * time.
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
