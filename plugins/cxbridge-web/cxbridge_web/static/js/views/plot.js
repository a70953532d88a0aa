// Values over time: fields of interfaces, slots of facts, durations of loops.
import { dashOf } from "cx/canvas.js";
import { button, clockText, dataTable, el, form, none, panel, redraw } from "cx/dom.js";
import { refill, submit, textInput, zeroOfTimes } from "cx/dom.js";
import { Chart } from "cx/plot/chart.js";
import { choices, Proposals } from "cx/plot/proposals.js";
import { numberText } from "cx/plot/series.js";
import { HINT } from "cx/plot/names.js";
import { plotAddress, plotsOf } from "cx/plot/store.js";
import { Lifetime } from "cx/scaffold.js";

export const tab = { title: "Plot", order: 55 };
export const moment = "own"; // the chart marks the selected moment itself
export const kinds = ["interface", "loop"];
const TICK_MS = 200; // the period of drawing while the chart follows a run
const MOST_SHOWN = 60; // completions at a time
let spanUs = 60e6; // the followed stretch of time; outlives the view

const timeText = (time, step) => clockText(time, step >= 1e6 ? 0 : step >= 1e3 ? 3 : 6);
/** A short line in the colour and pattern of a series, for the legend. */
function keyOf(colourNumber) {
  const dashed = dashOf(colourNumber).length ? " dashed" : "";
  return el.span({ class: "plot-key series-" + (colourNumber + 1) + dashed, "aria-hidden": "true" });
}

export function open(root, app) {
  const store = plotsOf(app),
    life = new Lifetime();
  let isFollowing = true, // the chart ends at the newest moment
    names = []; // of values that can be plotted, for completion
  const chart = new Chart(
    {
      moved() {
        isFollowing = false;
        drawTools();
      },
      zoomed() {
        if (isFollowing) spanUs = chart.span;
        drawSoon();
      },
      cursor: () => drawValues(),
      pick: (time) => app.select({ time: Math.round(time) }),
      all: showAll,
    },
    timeText,
  );
  life.add(() => chart.gone());
  const list = el("datalist#plot-names"),
    input = textInput({
      id: "plot-name",
      list: "plot-names",
      "aria-label": "value to plot",
      placeholder: HINT,
      on: { input: offer, focus: readNames },
    }),
    emptyBox = el.div({ hidden: true }),
    legend = el("div#plot-legend.plot-legend"),
    tools = el("div.tools");
  const addForm = form("#plot-add.call.plot-add", addTyped, input, submit("Add"), list);
  root.append(panel("Plot", [tools], el("div.plot-body", addForm, emptyBox, chart.box, legend)));

  function addTyped() {
    const reason = store.add(input.value);
    if (reason) return app.toast(reason + ". A value is called: " + HINT, true);
    input.value = "";
    offer();
    return readdress();
  }
  /** Offer the names that have all typed words; the browser's own completion only compares the beginning. */
  function offer() {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean),
      fitting = names.filter((name) => words.every((word) => name.toLowerCase().includes(word)));
    list.replaceChildren(...fitting.slice(0, MOST_SHOWN).map((value) => el.option({ value })));
  }
  async function readNames() {
    names = await choices(app);
    offer();
  }
  /** Write the plotted names into the address. */
  function readdress() {
    history.replaceState(history.state, "", plotAddress(store.names));
    app.selection.write();
    draw();
  }

  /** The newest moment of the run, in microseconds. */
  function end() {
    if (app.recording) return app.recording.end;
    const { status, connection } = app,
      last = Math.max(app.live.time, ...store.series.map(({ times, count }) => times[count - 1] || 0)),
      statusAgeMs = status?.clock === "real" ? performance.now() - app.statusAt : 0;
    return status && connection === "open" ? Math.max(last, status.now_us + statusAgeMs * 1000) : last;
  }
  /** The beginning of the recording, or of the live series, but at least a second before the end. */
  function begin() {
    if (app.recording) return app.recording.begin;
    return Math.min(end() - 1e6, ...store.series.filter(({ count }) => count).map(({ times }) => times[0]));
  }
  function showAll() {
    const from = begin(),
      to = end(),
      room = (to - from) * 0.01;
    isFollowing = false;
    chart.look(from - room, to + room);
    drawTools();
  }

  function toggleFollowing() {
    isFollowing = !isFollowing;
    draw();
  }
  function drawTools() {
    refill(
      tools,
      !app.recording && button("Follow", toggleFollowing, { "aria-pressed": String(isFollowing) }),
      button("−", () => chart.zoom(1 / 1.5), { "aria-label": "zoom out" }),
      button("+", () => chart.zoom(1.5), { "aria-label": "zoom in" }),
      button("All", showAll, { title: "show everything (0)" }),
    );
  }

  function draw() {
    const hasSeries = store.names.length > 0;
    emptyBox.hidden = hasSeries;
    chart.box.hidden = legend.hidden = !hasSeries;
    if (!hasSeries) drawProposals();
    chart.show(store.series);
    chart.end = end();
    chart.zero = zeroOfTimes() ?? 0;
    chart.mark(app.recording ? app.recording.time : app.selection.value.time);
    if (!app.recording && isFollowing) chart.look(chart.end - spanUs, chart.end);
    drawTools();
    drawLegend();
    drawValues();
  }

  const proposals = new Proposals(app.recording?.events);
  if (!app.recording) life.add(app.live.onEvent((event) => proposals.take(event)));
  function drawProposals() {
    const { best } = proposals,
      bestNames = best.map(({ name }) => name);
    const plotAll = (wantedNames) => () => {
      for (const name of wantedNames) store.add(name);
      readdress();
    };
    const row = ({ name, count, least, greatest }) => [
      el.th({ scope: "row" }, name),
      ...[numberText(least), numberText(greatest), count],
      button("Plot", plotAll([name]), { "aria-label": "plot " + name }),
    ];
    const heads = ["value", "least", "greatest", "changes", el.td()];
    redraw(emptyBox, bestNames, () => [
      none(
        "Nothing is plotted yet",
        best.length
          ? "These values changed most. You can also type a name above."
          : "Type the name of a value above, or press “plot” next to a field in Blackboard.",
      ),
      best.length > 0 && dataTable({ id: "proposals" }, heads, best.map(row), [1, 2, 3]),
      best.length > 1 && button("Plot all " + best.length, plotAll(bestNames), { class: "primary" }),
    ]);
  }

  const cells = new Map(); // name -> the cells of its value, least and greatest
  function drawLegend() {
    const heads = ["value", "of", "at the cursor", "least seen", "greatest seen", el.td()];
    redraw(legend, [store.names, Boolean(app.recording)], () => {
      cells.clear();
      return dataTable({}, heads, store.series.map(legendRow));
    });
  }
  function legendRow({ name, colourNumber, source }) {
    const values = ["value", "least", "greatest"].map((figure) => el.td({ class: "n " + figure }));
    cells.set(name, values);
    const remove = () => {
      store.remove(name);
      readdress();
    };
    return el.tr(
      { "data-series": name },
      el.th({ scope: "row" }, keyOf(colourNumber), " ", el.b(source.label)),
      el("td.dim.small.main-text", source.about),
      values,
      el.td(button("×", remove, { class: "quiet", "aria-label": "remove " + name })),
    );
  }
  function drawValues() {
    const time = chart.cursor ?? chart.moment ?? end();
    for (const series of store.series) {
      const bounds = (!series.words && series.range(chart.from, chart.to)) || ["", ""], // least, greatest
        value = series.count ? series.text(series.at(time)) || "not yet" : "no samples",
        texts = [value, ...bounds.map((bound) => (bound === "" ? "" : numberText(bound)))];
      for (const [index, cell] of (cells.get(series.name) || []).entries()) cell.textContent = texts[index];
    }
  }

  const drawSoon = life.framed(draw),
    { recording } = app;
  let drawnCount = null; // the number of events up to the drawn moment
  const drawIfMoved = () => {
    if (drawnCount !== recording.at) drawSoon();
    drawnCount = recording.at;
  };
  if (recording) life.follow(recording, drawIfMoved);
  life.listen(app, "select", drawSoon);
  life.add(store.onChange(drawSoon), app.onChange(drawTools));
  life.every(TICK_MS, () => !app.recording && isFollowing && draw());
  readNames();
  return {
    go(parts) {
      const wantedNames = parts.filter(Boolean),
        reason = wantedNames.length && store.show(wantedNames);
      if (reason) app.toast(reason, true);
      readdress();
      if (app.recording) showAll();
    },
    close: life.close,
  };
}
