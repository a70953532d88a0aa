// Interfaces: who writes and reads them, their values as they change, and messages to send.
import { get, part, throttled } from "cx/api.js";
import { idPath, messageForm, sentMessages } from "cx/blackboard/messages.js";
import { button, clockText, el, none, pairs, panel, refill, search, tabs } from "cx/dom.js";
import { fieldNames } from "cx/plot/names.js";
import { plot } from "cx/plot/store.js";
import { VirtualList } from "cx/virtual.js";

export const tab = { title: "Blackboard", order: 50 };
export const kinds = ["interface"];
const SOON_MS = 1000,
  LIST_MS = 5000;

export const blackboardTabs = (current) =>
  tabs(
    "Parts of the blackboard",
    [
      ["#/blackboard", "Interfaces"],
      ["#/blackboard/graph", "Graph"],
      ["#/blackboard/transforms", "Transforms"],
    ],
    current,
  );

export function open(root, app) {
  let infos = [],
    wanted = "",
    chosen = "",
    problem = "",
    data = null;
  const list = new VirtualList({
    label: "Interfaces",
    key: (item) => item.uid,
    sign: (item) => item.writer + item.readers.length + item.writes,
    height: "--row-two",
    draw: (item) => [
      el(
        "span.two",
        el("span.main-text", el.b(item.id), el("span.dim", "  " + item.type)),
        el(
          "span.dim.small.main-text",
          item.writer ? "written by " + item.writer : item.known ? "no writer" : "",
          item.readers.length
            ? ", " + item.readers.length + (item.readers.length === 1 ? " reader" : " readers")
            : "",
        ),
      ),
      item.writes ? el("span.dim.small.n", item.writes + "×") : null,
    ],
    select: (item) => {
      location.hash = "#/blackboard/" + part(item.uid);
    },
  });
  const empty = el.div({ hidden: true });
  const counter = el("span.dim.count");
  const head = el.div(),
    values = el("div#values"),
    formPlace = el.div(),
    sent = el("div#messages");
  const detail = el("div.detail", head, values, formPlace, sent);
  const layout = el(
    "div.split",
    panel(
      "Blackboard",
      [
        counter,
        search("Search interfaces", (text) => {
          wanted = text;
          draw();
        }),
      ],
      el.div(blackboardTabs("#/blackboard")),
      empty,
      list.box,
    ),
    detail,
  );
  root.append(layout);

  const info = () => infos.find((each) => each.uid === chosen);
  const readList = throttled(
    async () => {
      infos = (await get("blackboard/interfaces")).map((each) => ({
        ...each,
        uid: each.type + "::" + each.id,
        writer: each.writer || "",
        known: true,
      }));
      problem = "";
      draw();
      drawHead();
    },
    LIST_MS,
    (error) => {
      problem = error.message;
      draw();
    },
  );
  const readData = throttled(
    async () => {
      const of = info();
      if (!of) return;
      const answer = await get("blackboard/interfaces/" + part(of.type) + "/" + idPath(of.id) + "/data");
      if (of.uid === chosen) {
        data = answer;
        drawValues();
      }
    },
    SOON_MS,
    (error) => {
      problem = error.message;
    },
  );

  function rows() {
    if (!app.recording) return infos;
    return [...app.model.interfaces.keys()].sort().map((uid) => {
      const [type, id] = split(uid);
      return { uid, type, id, writer: "", readers: [], known: false, fields: [], message_types: [] };
    });
  }
  function split(uid) {
    const at = uid.indexOf("::");
    return [uid.slice(0, at), uid.slice(at + 2)];
  }
  function draw() {
    const all = rows(),
      items = all
        .filter((each) => each.uid.toLowerCase().includes(wanted))
        .map((each) => ({
          ...each,
          writes: app.recording ? (app.model.interfaces.get(each.uid) || { writes: 0 }).writes : 0,
        }));
    counter.textContent =
      items.length === all.length ? String(all.length) : items.length + " of " + all.length;
    list.box.hidden = !items.length;
    empty.hidden = items.length > 0;
    if (!items.length)
      empty.replaceChildren(
        all.length
          ? none("No interface matches")
          : none(problem || "No interfaces", problem ? "" : "Nobody has opened one."),
      );
    list.set(items);
  }

  let drawnHead = "";
  function drawHead() {
    layout.classList.toggle("has-detail", Boolean(chosen));
    const of = info() || rows().find((each) => each.uid === chosen);
    const sign = JSON.stringify([chosen, of, app.whyNot]);
    if (sign === drawnHead) return;
    drawnHead = sign;
    if (!of) {
      head.replaceChildren(
        none(
          chosen ? "There is no " + chosen : "Choose an interface",
          chosen ? "" : "Its values are shown here as they change; messages can be sent to its writer.",
        ),
      );
      for (const each of [values, formPlace, sent]) each.replaceChildren();
      return;
    }
    head.replaceChildren(
      el(
        "div.detail-head",
        el("a.back", { href: "#/blackboard", "aria-label": "back to the interfaces" }, "←"),
        el.h2(of.id),
        el("span.dim", of.type),
      ),
      pairs([
        ["writer", of.known ? of.writer || "none" : ""],
        ["readers", of.readers.join(", ")],
        ["hash", of.hash ? el.code(of.hash) : ""],
      ]),
    );
    formPlace.replaceChildren(messageForm(app, of) || "");
    if (of.known) readData();
  }

  const show = (value) =>
    Array.isArray(value)
      ? value.map(show).join(", ")
      : typeof value === "object" && value !== null
        ? JSON.stringify(value)
        : String(value);
  const cells = new Map();
  let cellsOf = "";
  function drawValues() {
    const live = app.model.interfaces.get(chosen);
    const now = { ...(data && !app.recording ? data.data : {}), ...(live ? live.values : {}) };
    const of = info(),
      names = Object.keys(now);
    const sign = chosen + "\n" + names.join("\n");
    if (sign !== cellsOf) {
      cellsOf = sign;
      cells.clear();
      const types = new Map(
        (of ? of.fields : []).map((field) => [field.name, field.type + (field.is_array ? "[]" : "")]),
      );
      const body = names.map((name) => {
        const cell = el("td.value");
        cells.set(name, cell);
        return el.tr(
          el.th({ scope: "row" }, name),
          el("td.dim.small", types.get(name) || ""),
          cell,
          el.td(
            button("plot", () => plot(app, fieldNames(chosen, name, now[name])), {
              class: "quiet small",
              "aria-label": "plot " + name,
            }),
          ),
        );
      });
      refill(
        values,
        el.h3("Values ", el("span#written.dim.n")),
        names.length
          ? el("div.wide", el("table.values-table", el.tbody(body)))
          : el("p.dim", of && !of.fields.length ? "It has no fields." : "No values yet."),
      );
    }
    for (const [name, cell] of cells) {
      const text = show(now[name]);
      if (cell.textContent === text) continue;
      const first = cell.textContent === "";
      cell.textContent = text;
      if (!first && cell.animate && !matchMedia("(prefers-reduced-motion: reduce)").matches)
        cell.animate([{ backgroundColor: "var(--mark)" }, { backgroundColor: "transparent" }], 900);
    }
    const written = document.getElementById("written");
    if (written) written.textContent = live ? clockText(live.time, 3) : data ? data.timestamp : "";
  }
  const drawMessages = () => refill(sent, ...sentMessages(app, chosen));

  const stop = app.model.onChange((topics) => {
    if (topics.has("interfaces")) {
      drawValues();
      draw();
      if (
        !app.recording &&
        [...app.model.interfaces.keys()].some(
          (uid) => infos.length && !infos.some((each) => each.uid === uid),
        )
      )
        readList();
    }
    if (topics.has("messages")) drawMessages();
  });
  const renewed = app.onRenew(() => {
    readList();
    readData();
  });
  if (!app.recording) readList();
  const again = setInterval(() => {
    if (!app.recording && !document.hidden) readList();
  }, 2 * LIST_MS);
  draw();
  return {
    go([uid = ""]) {
      chosen = uid;
      data = null;
      drawnHead = "";
      list.mark(uid, true);
      drawHead();
      if (chosen) {
        drawValues();
        drawMessages();
      }
    },
    close() {
      stop();
      renewed();
      clearInterval(again);
      readList.stop();
      readData.stop();
      list.gone();
    },
  };
}
