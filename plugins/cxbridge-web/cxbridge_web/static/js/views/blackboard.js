// Interfaces: writers, readers, values as they change, and messages to send.
import { get, idPath, part } from "cx/api.js";
import { messageForm, sentMessages } from "cx/blackboard/messages.js";
import { backLink, button, clockText, dim, el, none, note, pairs, plural, redraw, refill } from "cx/dom.js";
import { fieldNames } from "cx/plot/names.js";
import { plot } from "cx/plot/store.js";
import { goTo, ListPanel } from "cx/scaffold.js";

export const tab = { title: "Blackboard", order: 50 };
export const kinds = ["interface"];
const SOON_MS = 1000,
  LIST_MS = 5000;
const readersOf = ({ readers }) => (readers.length ? ", " + plural(readers.length, "reader") : "");
const interfaceRow = (item) => [
  el(
    "span.two",
    el("span.main-text", el.b(item.id), dim("  " + item.type)),
    el(
      "span.dim.small.main-text",
      (item.writer ? "written by " + item.writer : item.known ? "no writer" : "") + readersOf(item),
    ),
  ),
  item.writes ? el("span.dim.small.n", item.writes + "×") : null,
];
/** An interface of a recording, which has only values. */
function recordedInterface(uid) {
  const [type, id] = uid.split(/::(.*)/s);
  return { uid, type, id, writer: "", readers: [], known: false, fields: [], message_types: [] };
}
function valueText(value) {
  if (Array.isArray(value)) return value.map(valueText).join(", ");
  return typeof value === "object" && value !== null ? JSON.stringify(value) : String(value);
}
function flash(cell) {
  if (cell.animate && !matchMedia("(prefers-reduced-motion: reduce)").matches)
    cell.animate([{ backgroundColor: "var(--mark)" }, { backgroundColor: "transparent" }], 900);
}

export function open(root, app) {
  let infos = [],
    chosen = "",
    data = null;
  const head = el.div(),
    values = el("div#values"),
    formPlace = el.div(),
    sent = el("div#messages");
  const page = new ListPanel(
    {
      title: "Blackboard",
      find: "Search interfaces",
      detail: el("div.detail", head, values, formPlace, sent),
      row: {
        key: (item) => item.uid,
        sign: (item) => item.writer + item.readers.length + item.writes,
        height: "--row-two",
        draw: interfaceRow,
        select: (item) => goTo("#/blackboard/" + part(item.uid)),
      },
    },
    draw,
  );
  root.append(page.split);

  const info = () => infos.find((each) => each.uid === chosen);
  const { life } = page;
  const readList = page.reader(async () => {
    const found = await get("blackboard/interfaces"),
      infoOf = ({ type, id, writer, ...rest }) => ({
        uid: type + "::" + id,
        type,
        id,
        writer: writer || "",
        ...rest,
      });
    infos = found.map((each) => ({ ...infoOf(each), known: true }));
    drawHead();
  }, LIST_MS);
  const readData = life.reader(async () => {
    const of = info();
    if (!of) return;
    const answer = await get("blackboard/interfaces/" + part(of.type) + "/" + idPath(of.id) + "/data");
    if (of.uid !== chosen) return;
    data = answer;
    drawValues();
  }, SOON_MS);

  const all = () => (app.recording ? [...app.model.interfaces.keys()].sort().map(recordedInterface) : infos);
  function draw() {
    const found = all(),
      writesOf = ({ uid }) => (app.recording ? (app.model.interfaces.get(uid)?.writes ?? 0) : 0),
      items = found
        .filter(({ uid }) => page.matches(uid))
        .map((each) => ({ ...each, writes: writesOf(each) }));
    page.show(items, found.length, "No interfaces", "No interface is open.");
  }
  function drawHead() {
    page.showsDetail(chosen);
    const of = info() || all().find((each) => each.uid === chosen);
    if (!redraw(head, [chosen, of, app.whyNot], () => (of ? headOf(of) : nothing()))) return;
    refill(formPlace, of && messageForm(app, of));
    if (!of) for (const each of [values, sent]) redraw(each, "", () => []);
    if (of?.known) readData();
  }
  const nothing = () =>
    chosen
      ? none("There is no " + chosen)
      : none(
          "Choose an interface",
          "You see its values as they change" +
            (app.recording ? "." : ", and can send messages to its writer."),
        );
  const headOf = (of) => [
    el("div.detail-head", backLink("#/blackboard", "interfaces"), el.h2(of.id), dim(of.type)),
    pairs([
      ["writer", of.known ? of.writer || "none" : ""],
      ["readers", of.readers.join(", ")],
      ["hash", of.hash ? el.code(of.hash) : ""],
    ]),
  ];

  const cells = new Map();
  function drawValues() {
    const live = app.model.interfaces.get(chosen),
      now = { ...(data && !app.recording ? data.data : {}), ...live?.values };
    redraw(values, [chosen, Object.keys(now)], () => valuesTable(now));
    for (const [name, cell] of cells) {
      const text = valueText(now[name]),
        isFirst = cell.textContent === "";
      if (cell.textContent === text) continue;
      cell.textContent = text;
      if (!isFirst) flash(cell);
    }
    const written = document.getElementById("written");
    if (written) written.textContent = live ? clockText(live.time, 3) : data ? data.timestamp : "";
  }
  function valuesTable(now) {
    const { fields } = info() || { fields: null },
      types = new Map(fields?.map(({ name, type, is_array: many }) => [name, type + (many ? "[]" : "")])),
      missing = fields && !fields.length ? "The interface has no fields." : "No values yet.";
    cells.clear();
    const rows = Object.keys(now).map((name) => {
      cells.set(name, el("td.value"));
      const add = () => plot(app, fieldNames(chosen, name, now[name])),
        plotting = button("plot", add, { class: "quiet small", "aria-label": "plot " + name });
      return el.tr(
        el.th({ scope: "row" }, name),
        el("td.dim.small", types.get(name)),
        cells.get(name),
        el.td(plotting),
      );
    });
    return [
      el.h3("Values ", el("span#written.dim.n")),
      rows.length ? el("div.wide", el("table.values-table", el.tbody(rows))) : note(missing),
    ];
  }
  const drawMessages = () => refill(sent, sentMessages(app, chosen));

  life.add(
    app.model.onChange((topics) => {
      if (topics.has("messages")) drawMessages();
      if (!topics.has("interfaces")) return;
      drawValues();
      draw();
      const known = new Set(infos.map(({ uid }) => uid));
      if (!app.recording && infos.length && [...app.model.interfaces.keys()].some((uid) => !known.has(uid)))
        readList();
    }),
    app.onRenew(() => {
      readList();
      readData();
    }),
  );
  if (!app.recording) {
    readList();
    life.every(2 * LIST_MS, readList);
  }
  draw();
  return {
    go([uid = ""]) {
      chosen = uid;
      data = null;
      redraw(head);
      page.list.mark(uid, true);
      drawHead();
      if (!chosen) return;
      drawValues();
      drawMessages();
    },
    close: life.close,
  };
}
