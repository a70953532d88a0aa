// The start of the page: views, routes, header, keys.
import SITE from "shared/site.js";
import NAMES from "shared/views.js";
import { app } from "cx/app.js";
import { el, none } from "cx/dom.js";
import { header } from "cx/header.js";
import { keys } from "cx/keys.js";
import { openNoRun, openNotFound } from "cx/not_found.js";
import { palette } from "cx/palette.js";
import { bytesInside, dropZone, openLinked } from "cx/recording/open.js";
import { scrubber } from "cx/recording/scrubber.js";
import { parseAddress } from "cx/selection.js";
import { applyTheme } from "cx/theme.js";

const main = document.getElementById("main");
window.addEventListener("error", (event) => app.toast("Error of the page: " + event.message, true));

const LAST_ORDER = 1000; // the order of a tab without an order
/**
 * Load the views: each is one file in views/, which the server lists. A file that exports `tab` is a tab at
 * "#/FILE". A file that cannot be loaded is left out.
 * @returns {{name, title, order, formerly, module}[]} the tabs in their order; `formerly` has earlier names
 */
async function loadViews() {
  const tabs = [];
  const load = async (name) => {
    const module = await import("cx/views/" + name + ".js"),
      { tab } = module;
    if (tab) tabs.push({ order: LAST_ORDER, ...tab, name, formerly: [tab.formerly || []].flat(), module });
  };
  const failed = (name) => (error) =>
    app.toast("The view " + name + " cannot be shown: " + error.message, true);
  await Promise.all(NAMES.map((name) => load(name).catch(failed(name))));
  tabs.sort((a, b) => a.order - b.order || (a.name < b.name ? -1 : 1));
  return tabs;
}

/** Make the links of the tabs. Returns a function that marks the link of the open view. */
function navigation(tabs) {
  const links = tabs.map(({ name, title }, at) => {
    const key = at < 9 ? String(at + 1) : null, // 1 to 9; see keys.js
      keyLabel = key && el.kbd({ "aria-hidden": "true" }, key);
    return el.a({ href: "#/" + name, "data-view": name, "aria-keyshortcuts": key }, keyLabel, title);
  });
  document.getElementById("nav").append(...links);
  return (name) => {
    for (const link of links) link.removeAttribute("aria-current");
    const current = links.find((link) => link.dataset.view === name);
    current?.setAttribute("aria-current", "page");
    current?.scrollIntoView({ block: "nearest", inline: "nearest" });
  };
}

/** Return a function that opens the view of the address. */
function router(tabs) {
  const mark = navigation(tabs);
  let current = null; // {view, source}: the open view, and its module or its unknown address

  function close() {
    if (current) current.view.close();
    current = null;
  }
  function show(name, title, source, kinds, open) {
    close();
    main.replaceChildren();
    app.toMoment(source.moment);
    app.wants(app.recording ? [] : kinds);
    current = { source, view: open() };
    document.title = title + " – cxbridge";
    mark(name);
  }
  function route() {
    if (location.hash && !location.hash.startsWith("#/")) return; // the skip link
    if (app.runs && !app.recording) return; // the recording is still being read, or is unreadable
    const { path, parts, query } = parseAddress(location.hash),
      [name, ...viewParts] = parts,
      tab = tabs.find((each) => each.name === name),
      renamedTab = tabs.find(({ formerly }) => formerly.includes(name));
    if (!name && tabs.length) location.replace("#/" + tabs[0].name + location.hash.slice(path.length));
    else if (!tab && renamedTab) location.replace(location.hash.replace("#/" + name, "#/" + renamedTab.name));
    else if (!tab) show("", "Not found", path, [], () => openNotFound(main, path, tabs));
    if (!tab) return;
    const { module } = tab;
    app.selection.read(query);
    if (!current || current.source !== module)
      show(name, tab.title, module, module.kinds, () => module.open(main, app));
    current.view.go(viewParts);
    app.selection.read(query); // again: go() may have selected a goal, which clears the action of the query
    app.selection.write();
  }
  app.reopen = () => {
    close();
    route();
  };
  window.addEventListener("hashchange", route);
  return route;
}

/** Show the JSON document inside the page. */
async function openDocument({ kind, name }) {
  const text = new TextDecoder().decode(await bytesInside()),
    { open } = await import("cx/documents/" + kind + ".js");
  document.title = name;
  document.getElementById("head").append(el.h1(name));
  open(main, JSON.parse(text));
}

async function start() {
  if (SITE.inside?.kind) return openDocument(SITE.inside);
  const views = await loadViews(),
    names = views.map(({ name, title }) => [name, title]);
  header(app, palette(app, names));
  scrubber(app);
  dropZone(app);
  keys(app, names);
  const route = router(views);
  app.start();
  if (!app.runs) {
    await app.firstStatus();
    route();
    return openLinked(app);
  }
  app.selection.read(parseAddress(location.hash).query); // a moment of the recording
  await openLinked(app);
  if (app.recording) return null;
  app.hasNoRun = true;
  app.notify();
  return openNoRun(main, app.runs);
}

applyTheme();
if (typeof EventSource === "undefined") main.append(none("This browser is too old for this page"));
else start();
