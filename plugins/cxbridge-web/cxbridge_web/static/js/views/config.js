// The configuration, the daemon's components, and its plugins.
import { get, part, put, throttled } from "cx/api.js";
import { button, timeOfDay, el, none, panel, search, tabs } from "cx/dom.js";
import { badge } from "cx/dom.js";
import { componentBadge } from "cx/looks.js";
import { VirtualList } from "cx/virtual.js";

export const tab = { title: "Config", order: 90, formerly: "settings" };
export const kinds = [];
const TABS = [
  ["config", "Configuration"],
  ["plugins", "Plugins"],
  ["components", "Components"],
];
const SOON_MS = 1000;

export function open(root, app) {
  let tab = "config",
    wanted = "",
    values = [],
    plugins = [],
    problem = "";
  const bar = el.div(),
    body = el("div.fill.scroll-page"),
    empty = el.div({ hidden: true });
  const counter = el("span.dim.count");
  const find = search("Search", (text) => {
    wanted = text;
    draw();
  });
  const list = new VirtualList({
    label: "Configuration",
    key: (item) => item.path,
    sign: (item) => item.value,
    draw: (item) => [
      el("code.main-text.end-first", { title: item.path }, el.bdi(item.path)),
      el("code.value-text", item.value),
    ],
    select: (item) => {
      whole.hidden = false;
      whole.replaceChildren(el("p.dim", el.code(item.path)), el.pre(item.value));
    },
  });
  const whole = el("div.log-whole", { hidden: true });
  root.append(panel("Config", [counter, find], bar, empty, list.box, whole, body));

  function flat(value, path, into) {
    if (value !== null && typeof value === "object" && !Array.isArray(value))
      for (const [name, each] of Object.entries(value)) flat(each, path + "/" + name, into);
    else into.push({ path, value: Array.isArray(value) ? "[" + value.join(", ") + "]" : String(value) });
    return into;
  }
  const fail = (error) => {
    problem = error.message;
    draw();
  };
  const readConfig = throttled(
    async () => {
      values = flat((await get("config")).config, "", []);
      problem = "";
      draw();
    },
    SOON_MS,
    fail,
  );
  const readPlugins = throttled(
    async () => {
      plugins = await get("plugins");
      problem = "";
      draw();
    },
    SOON_MS,
    fail,
  );

  function nothing(text, hint = "") {
    empty.hidden = false;
    empty.replaceChildren(none(text, hint));
  }
  function draw() {
    find.hidden = tab === "components";
    list.box.hidden = tab !== "config";
    body.hidden = tab === "config";
    empty.hidden = true;
    if (tab !== "config") whole.hidden = true;
    if (app.recording) {
      list.box.hidden = body.hidden = true;
      counter.textContent = "";
      nothing("Not in a recording", "cxbridge trace extract gets the files of a run out of its recording.");
      return;
    }
    if (tab === "config") {
      const items = values.filter(
        (item) => !wanted || (item.path + " " + item.value).toLowerCase().includes(wanted),
      );
      counter.textContent =
        items.length === values.length ? String(items.length) : items.length + " of " + values.length;
      list.box.hidden = !items.length;
      if (!items.length) nothing(values.length ? "Nothing matches" : problem || "Empty");
      list.set(items);
    } else if (tab === "plugins") drawPlugins();
    else drawComponents();
  }
  function drawPlugins() {
    const found = plugins.filter(
      (each) => !wanted || (each.name + " " + each.description).toLowerCase().includes(wanted),
    );
    counter.textContent = String(found.length);
    if (!found.length) {
      body.replaceChildren();
      nothing(plugins.length ? "Nothing matches" : problem || "No plugins");
      return;
    }
    body.replaceChildren(
      el(
        "ul.cards",
        found.map((each) =>
          el(
            "li.card",
            el(
              "div.card-text",
              el.b(each.name),
              el("span.dim", each.description),
              each.is_meta ? el("span.dim.small", "is " + each.meta_children.join(", ")) : null,
            ),
            each.is_loaded ? badge("done", "✓", "loaded") : badge("new", "○", "not loaded"),
            app.gate(
              button(each.is_loaded ? "Unload" : "Load", () => change(each), {
                "aria-label": (each.is_loaded ? "Unload " : "Load ") + each.name,
              }),
            ),
          ),
        ),
      ),
    );
  }
  async function change(plugin) {
    const wish = plugin.is_loaded ? "UNLOADED" : "LOADED";
    await app.attempt(
      () => put("plugins/" + part(plugin.name), { desired_state: wish }),
      plugin.name + " is " + wish.toLowerCase(),
    );
    readPlugins();
    app.readStatus();
  }
  function drawComponents() {
    const { status } = app;
    if (!status) {
      nothing("Nothing known yet");
      return;
    }
    counter.textContent = String(status.components.length);
    const loop = status.loop || {};
    body.replaceChildren(
      el(
        "p.dim",
        [
          "version " + status.version,
          "process " + status.pid,
          "since " + timeOfDay(status.started_us),
          "clock " + status.clock,
          loop.count ? loop.count + " loops, one in " + (loop.period_us / 1000).toFixed(1) + " ms" : "",
        ]
          .filter(Boolean)
          .join(" · "),
      ),
      el("p.dim", (status.endpoints || []).join(" · ")),
      el(
        "ul.cards",
        status.components.map((each) =>
          el(
            "li.card",
            el(
              "div.card-text",
              el.b(each.name),
              each.reason ? el("span.bad-text", each.reason) : null,
              el("span.dim.small", each.since_us ? "since " + timeOfDay(each.since_us) : ""),
            ),
            componentBadge(each.state),
          ),
        ),
      ),
    );
  }
  const renew = () => {
    if (app.recording) return;
    if (tab === "config") readConfig();
    else if (tab === "plugins") readPlugins();
    else app.readStatus();
  };
  const renewed = app.onRenew(renew);
  const again = setInterval(() => {
    if (tab === "components" && !app.recording) draw();
  }, 2000);
  return {
    go([name = "config"]) {
      const next = TABS.some(([key]) => key === name) ? name : "config";
      if (next !== tab) find.value = wanted = "";
      tab = next;
      bar.replaceChildren(
        tabs(
          "Parts",
          TABS.map(([key, title]) => ["#/config/" + key, title]),
          "#/config/" + tab,
        ),
      );
      problem = "";
      renew();
      draw();
    },
    close() {
      renewed();
      clearInterval(again);
      readConfig.stop();
      readPlugins.stop();
      list.gone();
    },
  };
}
