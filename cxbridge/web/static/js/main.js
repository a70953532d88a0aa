// Routes, header and keys.
import { app } from "./app.js";
import { el, none } from "./dom.js";
import { header } from "./header.js";
import { keys } from "./keys.js";
import { dropZone, openLinked } from "./recording/open.js";
import { scrubber } from "./recording/scrubber.js";
import * as blackboard from "./views/blackboard.js";
import * as clips from "./views/clips.js";
import * as domain from "./views/domain.js";
import * as environments from "./views/environments.js";
import * as goals from "./views/goals.js";
import * as graphs from "./views/graphs.js";
import * as log from "./views/log.js";
import * as settings from "./views/settings.js";
import * as skills from "./views/skills.js";
import * as timeline from "./views/timeline.js";

const VIEWS = [
  ["timeline", "Timeline", timeline],
  ["goals", "Goals", goals],
  ["skills", "Skills", skills],
  ["domain", "Domain", domain],
  ["blackboard", "Blackboard", blackboard],
  ["clips", "CLIPS", clips],
  ["log", "Log", log],
  ["settings", "Config", settings],
];
const PARTS = {
  "clips/environments": environments,
  "blackboard/graph": graphs,
  "blackboard/transforms": graphs,
}; // with a view of their own
const main = document.getElementById("main");
let current = null;

const links = VIEWS.map(([name, title], at) =>
  el(
    "a",
    { href: "#/" + name, "data-view": name, "aria-keyshortcuts": String(at + 1) },
    el("kbd", { "aria-hidden": "true" }, String(at + 1)),
    title,
  ),
);
document.getElementById("nav").append(...links);

function close() {
  if (current) current.view.close();
  current = null;
}

function route() {
  if (location.hash && !location.hash.startsWith("#/")) return; // the skip link
  const [name, ...rest] = location.hash
    .slice(2)
    .split("/")
    .map((text) => {
      try {
        return decodeURIComponent(text);
      } catch {
        return text;
      }
    });
  const found = VIEWS.find(([each]) => each === name);
  if (!found) {
    location.replace("#/timeline");
    return;
  }
  const view = PARTS[name + "/" + rest[0]] || found[2];
  if (!current || current.of !== view) {
    close();
    main.replaceChildren();
    app.wants(app.recording ? [] : view.kinds);
    current = { of: view, view: view.open(main, app) };
    document.title = found[1] + " – cxbridge";
    for (const link of links) {
      const is = link.dataset.view === name;
      if (is) {
        link.setAttribute("aria-current", "page");
        link.scrollIntoView({ block: "nearest", inline: "nearest" });
      } else link.removeAttribute("aria-current");
    }
  }
  current.view.go(rest);
}

app.reopen = () => {
  close();
  route();
};
window.addEventListener("hashchange", route);
window.addEventListener("error", (event) => app.toast("Error of the page: " + event.message, true));
header(app);
scrubber(app);
dropZone(app);
keys(
  app,
  VIEWS.map(([name, title]) => [name, title]),
);
if (typeof EventSource === "undefined") main.append(none("This browser is too old for this page"));
else {
  app.start();
  route();
  openLinked(app);
}
