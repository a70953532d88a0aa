// Routes, header and keys.
import SITE from "shared/site.js";
import { app } from "cx/app.js";
import { el, none } from "cx/dom.js";
import { header } from "cx/header.js";
import { keys } from "cx/keys.js";
import { openNoRun, openNotFound } from "cx/not_found.js";
import { palette } from "cx/palette/palette.js";
import { dropZone, inside, openLinked } from "cx/recording/open.js";
import { scrubber } from "cx/recording/scrubber.js";
import { parseAddress } from "cx/selection.js";
import { applyTheme } from "cx/theme.js";
import { loadViews } from "cx/views.js";

const main = document.getElementById("main");
window.addEventListener("error", (event) => app.toast("Error of the page: " + event.message, true));

function navigation(tabs) {
  const links = tabs.map(({ name, title }, at) =>
    el(
      "a",
      { href: "#/" + name, "data-view": name, "aria-keyshortcuts": at < 9 ? String(at + 1) : null },
      at < 9 ? el("kbd", { "aria-hidden": "true" }, String(at + 1)) : null,
      title,
    ),
  );
  document.getElementById("nav").append(...links);
  return (name) => {
    for (const link of links) {
      if (link.dataset.view === name) {
        link.setAttribute("aria-current", "page");
        link.scrollIntoView({ block: "nearest", inline: "nearest" });
      } else link.removeAttribute("aria-current");
    }
  };
}

function router({ tabs, parts }) {
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
    if (app.runs && !app.recording) return; // it is read, or cannot be read
    const { path, parts: words, query } = parseAddress(location.hash),
      [name, ...rest] = words;
    if (!name && tabs.length) {
      location.replace("#/" + tabs[0].name + location.hash.slice(path.length));
      return;
    }
    const found = tabs.find((tab) => tab.name === name);
    if (!found) {
      const moved = tabs.find((tab) => tab.formerly.includes(name));
      if (moved) location.replace(location.hash.replace("#/" + name, "#/" + moved.name));
      else show("", "Not found", path, [], () => openNotFound(main, path, tabs));
      return;
    }
    const module = parts.get(name + "/" + rest[0]) || found.module;
    app.selection.read(query);
    if (!current || current.of !== module)
      show(name, found.title, module, module.kinds, () => module.open(main, app));
    current.view.go(rest);
    app.selection.read(query); // an action belongs to the goal that the path names
    app.selection.write();
  }
  app.reopen = () => {
    close();
    route();
  };
  window.addEventListener("hashchange", route);
  return route;
}

applyTheme();

/** Show a document that is in the page, instead of a run. */
async function openDocument({ kind, name }) {
  const text = new TextDecoder().decode(await inside()),
    { open } = await import("cx/documents/" + kind + ".js");
  document.title = name;
  document.getElementById("head").append(el("h1", {}, name));
  open(main, JSON.parse(text));
}

async function start() {
  if (SITE.inside && SITE.inside.kind) {
    await openDocument(SITE.inside);
    return;
  }
  const views = await loadViews((name, error) =>
    app.toast("The view " + name + " cannot be shown: " + error.message, true),
  );
  const names = views.tabs.map(({ name, title }) => [name, title]);
  header(app, palette(app, names));
  scrubber(app);
  dropZone(app);
  keys(app, names);
  const route = router(views);
  app.start();
  if (app.runs) {
    app.selection.read(parseAddress(location.hash).query); // a moment of the recording
    await openLinked(app);
    if (app.recording) return;
    app.hasNoRun = true;
    app.notify();
    openNoRun(main, app.runs);
    return;
  }
  await app.firstStatus();
  route();
  openLinked(app);
}

if (typeof EventSource === "undefined") main.append(none("This browser is too old for this page"));
else start();
