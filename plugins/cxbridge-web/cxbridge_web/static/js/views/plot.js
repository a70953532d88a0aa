// Values over time: fields of interfaces, slots of facts, the time that loops take.
import { palette, save } from "cx/canvas.js";
import { button, clockText, zeroOfTimes, dataTable, el, none, panel, refill } from "cx/dom.js";
import { Chart, dashOf } from "cx/plot/chart.js";
import { choices } from "cx/plot/choices.js";
import { csv } from "cx/plot/csv.js";
import { HINT } from "cx/plot/names.js";
import { Proposals } from "cx/plot/proposals.js";
import { numberText } from "cx/plot/series.js";
import { plotAddress, plotsOf } from "cx/plot/store.js";

export const tab = { title: "Plot", order: 55 };
export const moment = "own";
export const kinds = ["interface", "loop"];
const WINDOWS = [
  [10e6, "10 s"],
  [60e6, "1 min"],
  [600e6, "10 min"],
  [0, "all"],
];
const TICK_MS = 200;
const MOST_SHOWN = 60; // completions at a time
let windowUs = 60e6; // stays when another view was open

export function open(root, app) {
  const store = plotsOf(app);
  let follows = true,
    names = [];
  const chart = new Chart(
    {
      moved() {
        if (app.recording || !follows) return;
        follows = false;
        drawTools();
      },
      cursor: () => drawValues(),
      pick: (time) => app.select({ time: Math.round(time) }),
      all: showAll,
    },
    (time, step) => timeText(time, step),
  );
  const list = el("datalist#plot-names");
  const input = el("input#plot-name", {
    type: "text",
    list: "plot-names",
    "aria-label": "value to plot",
    placeholder: HINT,
    spellcheck: "false",
    autocomplete: "off",
    autocapitalize: "off",
  });
  const form = el(
    "form#plot-add.call.plot-add",
    input,
    el("button.primary", { type: "submit" }, "Add"),
    list,
  );
  const empty = el.div({ hidden: true });
  const legend = el("div#plot-legend.plot-legend");
  const followBox = el("select#plot-window", { "aria-label": "how much of the past is shown" });
  const tools = el("div.tools");
  root.append(panel("Plot", [tools], el("div.plot-body", form, empty, chart.box, legend)));

  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const reason = store.add(input.value);
    if (reason) {
      app.toast(reason + ". A value is called: " + HINT, true);
      return;
    }
    input.value = "";
    offer();
    readdress();
  });
  input.addEventListener("input", offer);
  /** The names that have all words of what was typed: a browser's own list wants the begin. */
  function offer() {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    const fitting = names.filter((name) => words.every((word) => name.toLowerCase().includes(word)));
    list.replaceChildren(...fitting.slice(0, MOST_SHOWN).map((value) => el.option({ value })));
  }
  const readNames = async () => {
    names = await choices(app);
    offer();
  };
  input.addEventListener("focus", readNames);
  followBox.append(...WINDOWS.map(([us, text]) => el.option({ value: us, selected: us === windowUs }, text)));
  followBox.addEventListener("change", () => {
    windowUs = Number(followBox.value);
    follows = true;
    draw();
  });

  function timeText(time, step) {
    const digits = step >= 1e6 ? 0 : step >= 1e3 ? 3 : 6;
    return clockText(time, digits);
  }
  function readdress() {
    const address = plotAddress(store.names);
    history.replaceState(history.state, "", address);
    app.selection.write();
    draw();
  }

  /** The time up to which is known. */
  function end() {
    if (app.recording) return app.recording.end;
    const last = Math.max(app.live.time, ...store.series.map((each) => each.times[each.count - 1] || 0));
    if (!app.status) return last;
    const since = app.status.clock === "real" ? performance.now() - app.statusAt : 0;
    return Math.max(last, app.connection === "open" ? app.status.now_us + since * 1000 : 0);
  }
  function begin() {
    if (app.recording) return app.recording.begin;
    return Math.min(end() - 1e6, ...store.series.filter((each) => each.count).map((each) => each.times[0]));
  }
  function showAll() {
    const from = begin(),
      to = end(),
      room = (to - from) * 0.01;
    follows = false;
    chart.look(from - room, to + room);
    drawTools();
  }

  function drawTools() {
    const follow = button("Follow", () => {
      follows = !follows;
      draw();
    });
    follow.setAttribute("aria-pressed", String(follows));
    const has = store.names.length > 0;
    refill(
      tools,
      app.recording ? null : follow,
      app.recording ? null : followBox,
      button("−", () => chart.zoom(1 / 1.5), { "aria-label": "zoom out" }),
      button("+", () => chart.zoom(1.5), { "aria-label": "zoom in" }),
      button("All", showAll, { title: "show everything (0)" }),
      button("CSV", exportCsv, { disabled: !has, id: "plot-csv" }),
      button("PNG", exportPng, { disabled: !has, id: "plot-png" }),
    );
  }
  function exportCsv() {
    const text = csv(store.series, chart.from, chart.to);
    save(new Blob([text], { type: "text/csv" }), "plot.csv");
  }
  async function exportPng() {
    const { series } = palette();
    const lines = store.series.map((each) => ({
      text: each.source.label + "  " + each.source.about,
      colour: series[each.number],
    }));
    save(await chart.canvas.picture(lines), "plot.png");
  }

  function draw() {
    const has = store.names.length > 0;
    empty.hidden = has;
    chart.box.hidden = legend.hidden = !has;
    if (!has) drawProposals();
    chart.show(store.series);
    chart.end = end();
    chart.zero = zeroOfTimes() ?? 0;
    chart.mark(app.recording ? app.recording.time : app.selection.value.time);
    if (!app.recording && follows) {
      const to = end();
      chart.look(windowUs ? to - windowUs : begin(), to);
    }
    drawTools();
    drawLegend();
    drawValues();
  }

  const proposals = app.recording ? Proposals.of(app.recording.events) : new Proposals(),
    listens = app.recording ? () => {} : app.live.onEvent((event) => proposals.take(event));
  let drawnProposals = "";
  function drawProposals() {
    const { best } = proposals,
      names = best.map(({ name }) => name),
      sign = names.join("\n");
    if (sign === drawnProposals && empty.firstChild) return;
    drawnProposals = sign;
    const plot = (wanted) => () => {
      for (const name of wanted) store.add(name);
      readdress();
    };
    refill(
      empty,
      none(
        "Nothing is plotted yet",
        best.length
          ? "These values changed most. Or type a name above."
          : "Type the name of a value above, or press “plot” next to a field in Blackboard.",
      ),
      best.length
        ? dataTable(
            { id: "proposals" },
            [
              "value",
              ...["least", "greatest", "changes"].map((head) => el("th.n", { scope: "col" }, head)),
              el.td(),
            ],
            best.map(({ name, count, least, greatest }) =>
              el.tr(
                el.th({ scope: "row" }, name),
                [numberText(least), numberText(greatest), String(count)].map((text) => el("td.n", text)),
                el.td(button("Plot", plot([name]), { "aria-label": "plot " + name })),
              ),
            ),
          )
        : null,
      best.length > 1 ? button("Plot all " + best.length, plot(names), { class: "primary" }) : null,
    );
  }

  const cells = new Map();
  let drawnLegend = null;
  function drawLegend() {
    const sign = store.series.map((each) => each.name).join("\n");
    if (sign === drawnLegend) return;
    drawnLegend = sign;
    cells.clear();
    const rows = store.series.map((each) => {
      const parts = ["value", "least", "greatest"].map((what) => el.td({ class: "n " + what }));
      cells.set(each.name, parts);
      return el.tr(
        { "data-series": each.name },
        el.th({ scope: "row" }, key(each.number), " ", el.b(each.source.label)),
        el("td.dim.small.main-text", each.source.about),
        parts,
        el.td(
          button(
            "×",
            () => {
              store.remove(each.name);
              readdress();
            },
            { class: "quiet", "aria-label": "remove " + each.name },
          ),
        ),
      );
    });
    const heads = ["value", "of", "at the cursor", "least seen", "greatest seen", el.td()];
    refill(legend, dataTable({}, heads, rows));
  }
  /** A piece of the line, in its colour and pattern. */
  function key(number) {
    return el.span({
      class: "plot-key series-" + (number + 1) + (dashOf(number).length ? " dashed" : ""),
      "aria-hidden": "true",
    });
  }
  function drawValues() {
    const time = chart.cursor ?? chart.moment ?? end();
    for (const each of store.series) {
      const [value, least, greatest] = cells.get(each.name) || [];
      if (!value) continue;
      const range = each.words ? null : each.range(chart.from, chart.to);
      value.textContent = each.count ? each.text(each.at(time)) || "not yet" : "no samples";
      least.textContent = range ? numberText(range[0]) : "";
      greatest.textContent = range ? numberText(range[1]) : "";
    }
  }

  let shown = null;
  const select = () => soon();
  app.addEventListener("select", select);
  const stop = store.onChange(() => soon());
  let frame = 0;
  function soon() {
    frame ||= requestAnimationFrame(() => {
      frame = 0;
      draw();
    });
  }
  function moment() {
    if (app.recording && shown !== app.recording.at) {
      shown = app.recording.at;
      soon();
    }
  }
  const listened = app.recording;
  if (listened) listened.listeners.add(moment);
  const tick = setInterval(() => {
    if (!app.recording && follows && !document.hidden) draw();
  }, TICK_MS);
  const unsubscribe = app.onChange(drawTools);
  readNames();
  return {
    go(wanted) {
      const asked = wanted.filter(Boolean);
      if (asked.length) {
        const reason = store.show(asked);
        if (reason) app.toast(reason, true);
      }
      readdress();
      if (app.recording) showAll();
    },
    close() {
      stop();
      listens();
      unsubscribe();
      app.removeEventListener("select", select);
      clearInterval(tick);
      cancelAnimationFrame(frame);
      if (listened) listened.listeners.delete(moment);
      chart.gone();
    },
  };
}
