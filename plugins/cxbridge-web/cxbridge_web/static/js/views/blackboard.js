// Interfaces: writers, readers, values as they change, and messages to send.
import { escapePart, get, idPath } from "cx/api.js";
import { messageForm, sentMessages } from "cx/blackboard/messages.js";
import { backLink, button, clockText, dim, el, none, note, pairs, plural, redraw, refill } from "cx/dom.js";
import { fieldNames } from "cx/plot/names.js";
import { plot } from "cx/plot/store.js";
import { goTo, ListPanel } from "cx/scaffold.js";

export const tab = { title: "Blackboard", order: 50 };
export const kinds = ["interface"];
const VALUES_MS = 1000, // the shortest time between two requests for values
  LIST_MS = 5000; // the shortest time between two requests for the list
/** The text about the readers, which follows the writer; "" without readers. */
const readersOf = ({ readers }) => (readers.length ? ", " + plural(readers.length, "reader") : "");
const interfaceRow = (item) => [
  el(
    "span.two",
    el("span.main-text", el.b(item.id), dim("  " + item.type)),
    el(
      "span.dim.small.main-text",
      (item.writer ? "written by " + item.writer : item.isKnown ? "no writer" : "") + readersOf(item),
    ),
  ),
  item.writes ? el("span.dim.small.n", item.writes + "×") : null,
];
/** An interface of a recording, which has only values; the daemon knows more: `isKnown`. */
function recordedInterface(uid) {
  const [type, id] = uid.split(/::(.*)/s);
  return { uid, type, id, writer: "", readers: [], isKnown: false, fields: [], message_types: [] };
}
/** The text of a field's value. */
function valueText(value) {
  if (Array.isArray(value)) return value.map(valueText).join(", ");
  return typeof value === "object" && value !== null ? JSON.stringify(value) : String(value);
}
/** Highlight a value that has changed. */
function flash(cell) {
  if (cell.animate && !matchMedia("(prefers-reduced-motion: reduce)").matches)
    cell.animate([{ backgroundColor: "var(--mark)" }, { backgroundColor: "transparent" }], 900);
}

export function open(root, app) {
  let interfaces = [], // the interfaces of the daemon
    chosenUid = "", // a uid, TYPE::ID
    chosenData = null; // the API's answer with the values of the chosen interface
  const head = el.div(),
    values = el("div#values"),
    formPlace = el.div(),
    sentBox = el("div#messages");
  const page = new ListPanel(
    {
      title: "Blackboard",
      find: "Search interfaces",
      detail: el("div.detail", head, values, formPlace, sentBox),
      row: {
        key: (item) => item.uid,
        sign: (item) => item.writer + item.readers.length + item.writes,
        height: "--row-two",
        draw: interfaceRow,
        select: (item) => goTo("#/blackboard/" + escapePart(item.uid)),
      },
    },
    draw,
  );
  root.append(page.split);

  const chosenInterface = () => interfaces.find(({ uid }) => uid === chosenUid);
  const { life } = page;
  const readList = page.reader(async () => {
    const answer = await get("blackboard/interfaces"),
      toItem = ({ type, id, writer, ...members }) => ({
        uid: type + "::" + id,
        type,
        id,
        writer: writer || "",
        ...members,
      });
    interfaces = answer.map((row) => ({ ...toItem(row), isKnown: true }));
    drawHead();
  }, LIST_MS);
  const readData = life.reader(async () => {
    const item = chosenInterface();
    if (!item) return;
    const answer = await get(
      "blackboard/interfaces/" + escapePart(item.type) + "/" + idPath(item.id) + "/data",
    );
    if (item.uid !== chosenUid) return; // another interface was chosen during the request
    chosenData = answer;
    drawValues();
  }, VALUES_MS);

  const listedInterfaces = () =>
    app.recording ? [...app.model.interfaces.keys()].sort().map(recordedInterface) : interfaces;
  function draw() {
    const allShown = listedInterfaces(),
      writesOf = ({ uid }) => (app.recording ? (app.model.interfaces.get(uid)?.writes ?? 0) : 0),
      items = allShown
        .filter(({ uid }) => page.matches(uid))
        .map((item) => ({ ...item, writes: writesOf(item) }));
    page.show(items, allShown.length, "No interfaces", "No interface is open.");
  }
  function drawHead() {
    page.showDetailOf(chosenUid);
    const item = chosenInterface() || listedInterfaces().find(({ uid }) => uid === chosenUid);
    if (!redraw(head, [chosenUid, item, app.whyNot], () => (item ? headOf(item) : emptyHead()))) return;
    refill(formPlace, item && messageForm(app, item));
    if (!item) for (const node of [values, sentBox]) redraw(node, "", () => []);
    if (item?.isKnown) readData();
  }
  /** The hint in place of the head, while there is no interface to show. */
  const emptyHead = () =>
    chosenUid
      ? none("There is no " + chosenUid)
      : none(
          "Choose an interface",
          "You see its values as they change" +
            (app.recording ? "." : ", and can send messages to its writer."),
        );
  const headOf = (item) => [
    el("div.detail-head", backLink("#/blackboard", "interfaces"), el.h2(item.id), dim(item.type)),
    pairs([
      ["writer", item.isKnown ? item.writer || "none" : ""],
      ["readers", item.readers.join(", ")],
      ["hash", item.hash ? el.code(item.hash) : ""],
    ]),
  ];

  const cells = new Map(); // field -> the cell of its value
  function drawValues() {
    const live = app.model.interfaces.get(chosenUid),
      valuesByField = { ...(chosenData && !app.recording ? chosenData.data : {}), ...live?.values };
    redraw(values, [chosenUid, Object.keys(valuesByField)], () => valuesTable(valuesByField));
    for (const [name, cell] of cells) {
      const text = valueText(valuesByField[name]),
        isFirst = cell.textContent === "";
      if (cell.textContent === text) continue;
      cell.textContent = text;
      if (!isFirst) flash(cell);
    }
    const writtenNode = document.getElementById("written");
    if (writtenNode)
      writtenNode.textContent = live ? clockText(live.time, 3) : chosenData ? chosenData.timestamp : "";
  }
  function valuesTable(valuesByField) {
    const { fields } = chosenInterface() || { fields: null },
      types = new Map(
        fields?.map(({ name, type, is_array: isArray }) => [name, type + (isArray ? "[]" : "")]),
      ),
      missingText = fields && !fields.length ? "The interface has no fields." : "No values yet.";
    cells.clear();
    const rows = Object.keys(valuesByField).map((name) => {
      cells.set(name, el("td.value"));
      const plotField = () => plot(app, fieldNames(chosenUid, name, valuesByField[name])),
        plotButton = button("plot", plotField, { class: "quiet small", "aria-label": "plot " + name });
      return el.tr(
        el.th({ scope: "row" }, name),
        el("td.dim.small", types.get(name)),
        cells.get(name),
        el.td(plotButton),
      );
    });
    return [
      el.h3("Values ", el("span#written.dim.n")),
      rows.length ? el("div.wide", el("table.values-table", el.tbody(rows))) : note(missingText),
    ];
  }
  const drawMessages = () => refill(sentBox, sentMessages(app, chosenUid));

  life.add(
    app.model.onChange((topics) => {
      if (topics.has("messages")) drawMessages();
      if (!topics.has("interfaces")) return;
      drawValues();
      draw();
      const knownUids = new Set(interfaces.map(({ uid }) => uid));
      if (
        !app.recording &&
        interfaces.length &&
        [...app.model.interfaces.keys()].some((uid) => !knownUids.has(uid))
      )
        readList();
    }),
    app.onRenew(() => {
      readList();
      readData();
    }),
  );
  if (!app.recording) {
    readList();
    life.every(2 * LIST_MS, readList); // no event tells of new readers and writers
  }
  draw();
  return {
    go([uid = ""]) {
      chosenUid = uid;
      chosenData = null;
      redraw(head);
      page.list.mark(uid, true);
      drawHead();
      if (!chosenUid) return;
      drawValues();
      drawMessages();
    },
    close: life.close,
  };
}
