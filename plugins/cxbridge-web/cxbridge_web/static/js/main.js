// The start of the page: views, routes, header, keys.
import SITE from "shared/site.js";
import NAMES from "shared/views.js";
import { app } from "cx/app.js";
import { el, none } from "cx/dom.js";
import { header } from "cx/header.js";
import { keys } from "cx/keys.js";
import { openNoRun, openNotFound } from "cx/not_found.js";
import { palette } from "cx/palette.js";
import { dropZone, inside, openLinked } from "cx/recording/open.js";
import { scrubber } from "cx/recording/scrubber.js";
import { parseAddress } from "cx/selection.js";
import { applyTheme } from "cx/theme.js";

const main = document.getElementById("main");
window.addEventListener("error", (event) => app.toast("Error of the page: " + event.message, true));

/**
 * Load the views: each is one file in views/, which the server lists. A file that exports `tab` is a tab at
 * "#/FILE". A file that cannot be loaded is left out.
 * @returns {{name, title, formerly, module}[]} the tabs in their order
 */
async function loadViews() {
  const tabs = [];
  const load = async (name) => {
    const module = await import("cx/views/" + name + ".js"),
      { tab } = module;
    if (tab) tabs.push({ order: 1000, ...tab, name, formerly: [tab.formerly || []].flat(), module });
  };
  const failed = (name) => (error) =>
    app.toast("The view " + name + " cannot be shown: " + error.message, true);
  await Promise.all(NAMES.map((name) => load(name).catch(failed(name))));
  tabs.sort((a, b) => a.order - b.order || (a.name < b.name ? -1 : 1));
  return tabs;
}

function navigation(tabs) {
  const links = tabs.map(({ name, title }, at) => {
    const key = at < 9 ? String(at + 1) : null,
      shown = key && el.kbd({ "aria-hidden": "true" }, key);
    return el.a({ href: "#/" + name, "data-view": name, "aria-keyshortcuts": key }, shown, title);
  });
  document.getElementById("nav").append(...links);
  return (name) => {
    for (const link of links) link.removeAttribute("aria-current");
    const current = links.find((link) => link.dataset.view === name);
    current?.setAttribute("aria-current", "page");
    current?.scrollIntoView({ block: "nearest", inline: "nearest" });
  };
}

function router(tabs) {
  const mark = navigation(tabs);
  let current = null;

  function close() {
    if (current) current.view.close();
    current = null;
  }
  function show(name, title, of, kinds, open) {
    close();
    main.replaceChildren();
    app.toMoment(of.moment);
    app.wants(app.recording ? [] : kinds);
    current = { of, view: open() };
    document.title = title + " – cxbridge";
    mark(name);
  }
  function route() {
    if (location.hash && !location.hash.startsWith("#/")) return; // the skip link
    if (app.runs && !app.recording) return; // the recording is still being read, or is unreadable
    const { path, parts: words, query } = parseAddress(location.hash),
      [name, ...rest] = words,
      found = tabs.find((tab) => tab.name === name),
      moved = tabs.find((tab) => tab.formerly.includes(name));
    if (!name && tabs.length) location.replace("#/" + tabs[0].name + location.hash.slice(path.length));
    else if (!found && moved) location.replace(location.hash.replace("#/" + name, "#/" + moved.name));
    else if (!found) show("", "Not found", path, [], () => openNotFound(main, path, tabs));
    if (!found) return;
    const { module } = found;
    app.selection.read(query);
    if (!current || current.of !== module)
      show(name, found.title, module, module.kinds, () => module.open(main, app));
    current.view.go(rest);
    app.selection.read(query); // the path has named the goal of the action
    app.selection.write();
  }
  app.reopen = () => {
    close();
    route();
  };
  window.addEventListener("hashchange", route);
  return route;
}

async function openDocument({ kind, name }) {
  const text = new TextDecoder().decode(await inside()),
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
