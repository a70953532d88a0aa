// The configuration, the daemon's components, and its plugins.
import { get, part, put } from "cx/api.js";
import { badge, button, dim, el, note, refill, tabs, timeOfDay } from "cx/dom.js";
import { componentBadge } from "cx/outcome.js";
import { ListPanel } from "cx/scaffold.js";

export const tab = { title: "Config", order: 90, formerly: "settings" };
export const kinds = [];
const TABS = { config: "Configuration", plugins: "Plugins", components: "Components" };
const SOON_MS = 1000,
  AGAIN_MS = 2000;

function flat(value, path, into = []) {
  if (value !== null && typeof value === "object" && !Array.isArray(value))
    for (const [name, each] of Object.entries(value)) flat(each, path + "/" + name, into);
  else into.push({ path, value: Array.isArray(value) ? "[" + value.join(", ") + "]" : String(value) });
  return into;
}
const card = (text, ...more) => el("li.card", el("div.card-text", text), more);
const aboutDaemon = ({ version, pid, started_us: since, clock, loop = {} }) =>
  [
    "version " + version,
    "process " + pid,
    "since " + timeOfDay(since),
    "clock " + clock,
    loop.count ? loop.count + " loops, one in " + (loop.period_us / 1000).toFixed(1) + " ms" : "",
  ]
    .filter(Boolean)
    .join(" · ");
const componentCard = ({ name, reason, since_us: since, state }) =>
  card(
    [
      el.b(name),
      reason ? el("span.bad-text", reason) : null,
      el("span.dim.small", since ? "since " + timeOfDay(since) : ""),
    ],
    componentBadge(state),
  );

export function open(root, app) {
  let tab = "config",
    values = [],
    plugins = [];
  const bar = el.div(),
    body = el("div.fill.scroll-page"),
    whole = el("div.log-whole", { hidden: true });
  const page = new ListPanel(
    {
      title: "Config",
      find: "Search",
      above: bar,
      below: [whole, body],
      row: {
        key: (item) => item.path,
        sign: (item) => item.value,
        draw: ({ path, value }) => [
          el("code.main-text.end-first", { title: path }, el.bdi(path)),
          el("code.value-text", value),
        ],
        select: ({ path, value }) => {
          whole.hidden = false;
          refill(whole, note(el.code(path)), el.pre(value));
        },
      },
    },
    draw,
  );
  root.append(page.panel);

  const { life } = page,
    readConfig = page.reader(async () => {
      values = flat((await get("config")).config, "");
    }, SOON_MS),
    readPlugins = page.reader(async () => {
      plugins = await get("plugins");
    }, SOON_MS);

  function draw() {
    page.find.hidden = tab === "components";
    body.hidden = tab === "config" || Boolean(app.recording);
    if (tab !== "config") whole.hidden = true;
    const hint = "cxbridge trace extract gets the files of a run out of its recording.";
    if (app.recording) {
      page.show([], 0, "Not in a recording", hint);
      page.counter.textContent = "";
    } else if (tab === "config") {
      const items = values.filter(({ path, value }) => page.matches(path, value));
      page.show(items, values.length, "Empty");
    } else if (tab === "plugins") drawPlugins();
    else drawComponents();
  }
  function drawCards(items, total, nothing, ...above) {
    page.show([], total, nothing);
    page.empty.hidden = items.length > 0;
    page.counter.textContent = String(items.length);
    refill(body, items.length ? [above, el("ul.cards", items)] : []);
  }
  function drawPlugins() {
    const found = plugins.filter(({ name, description }) => page.matches(name, description));
    drawCards(found.map(pluginCard), plugins.length, "No plugins");
  }
  function pluginCard(plugin) {
    const { name, description, is_meta: isMeta, meta_children: children, is_loaded: isLoaded } = plugin,
      word = isLoaded ? "Unload" : "Load";
    return card(
      [el.b(name), dim(description), isMeta ? el("span.dim.small", "is " + children.join(", ")) : null],
      isLoaded ? badge("done", "✓", "loaded") : badge("new", "○", "not loaded"),
      app.gate(button(word, () => change(plugin), { "aria-label": word + " " + name })),
    );
  }
  async function change({ name, is_loaded: isLoaded }) {
    const wish = isLoaded ? "UNLOADED" : "LOADED",
      call = () => put("plugins/" + part(name), { desired_state: wish });
    await app.attempt(call, name + " is " + wish.toLowerCase());
    readPlugins();
    app.readStatus();
  }
  function drawComponents() {
    const { status } = app,
      about = status && [note(aboutDaemon(status)), note((status.endpoints || []).join(" · "))];
    drawCards(status?.components.map(componentCard) ?? [], 0, "Nothing known yet", about);
  }
  const renew = () => {
    if (!app.recording) ({ config: readConfig, plugins: readPlugins, components: app.readStatus })[tab]();
  };
  life.add(app.onRenew(renew));
  life.every(AGAIN_MS, () => tab === "components" && draw());
  return {
    go([name = "config"]) {
      const next = Object.hasOwn(TABS, name) ? name : "config";
      if (next !== tab) page.find.value = page.wanted = "";
      tab = next;
      const entries = Object.entries(TABS).map(([key, title]) => ["#/config/" + key, title]);
      refill(bar, tabs("Parts", entries, "#/config/" + tab));
      page.problem = "";
      renew();
      draw();
    },
    close: life.close,
  };
}
