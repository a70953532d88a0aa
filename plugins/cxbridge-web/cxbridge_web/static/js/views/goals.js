// The goals as a table, in the order of their trees; beside it the goal that is chosen.
import { part } from "cx/api.js";
import { Detail } from "cx/detail.js";
import { button, checkbox, clockText, durationText, el, none, paced } from "cx/dom.js";
import { envSelect } from "cx/env.js";
import { childrenOf, parentsOf } from "cx/forest.js";
import { filterQuery, goalFilter } from "cx/goals/filter.js";
import { durationOf, progressOf, robotsOf } from "cx/goals/numbers.js";
import { rowsOf } from "cx/goals/tree.js";
import { MAIN_ENV } from "cx/names.js";
import { goalOutcome, isOpen, outcomeBadge, OUTCOMES } from "cx/outcome.js";
import { inWords, reasonOf } from "cx/story/causes.js";
import { PageHost, timelineAddress } from "cx/timeline/host.js";
import { VirtualList } from "cx/virtual.js";

export const tab = { title: "Goals", order: 20 };
export const moment = "past";
export const kinds = [];
const TICK_MS = 1000;
const COLUMNS = ["outcome", "why", "robot", "done", "began", "took"];
const closed = new Set(); // stays when another view was open
let withGone = null; // null: while there are no others

/** Where the table shows a goal; its actions and skill calls are in the timeline. */
const address = (path) =>
  path.action || path.skill
    ? timelineAddress(path)
    : path.goal
      ? "#/goals/" + part(path.goal) + filterQuery()
      : "#/goals" + filterQuery({ goal: "" });

export function open(root, app) {
  let chosen = "",
    children = new Map();
  const host = new PageHost(app, () => drawDetail(), address),
    detail = new Detail(host, () => drawDetail());
  detail.box.id = "goal";
  detail.box.classList.add("detail");
  const list = new VirtualList({
    label: "Goals",
    height: "--row-goal",
    key: (item) => item.goal.key,
    sign: (item) => {
      const { mode, outcome, error, cls } = item.goal;
      return JSON.stringify([
        item.depth,
        item.open,
        item.inside,
        mode,
        outcome,
        error,
        cls,
        cellsOf(item.goal),
      ]);
    },
    draw: drawRow,
    select: (item, how) => {
      if (how !== "key" || root.clientWidth > 760) host.go({ goal: item.goal.key }, how === "key");
    },
    open: (item, on) => {
      if (on) closed.delete(item.goal.key);
      else closed.add(item.goal.key);
      draw();
    },
  });
  const counter = el("span.dim.count"),
    empty = el.div({ hidden: true });
  const envs = envSelect(
    app,
    () => {
      app.readGoals();
      draw();
    },
    { all: true },
  );
  const filter = goalFilter(app, () => draw());
  const goneBox = checkbox("gone too", false, (on) => {
    withGone = on;
    draw();
  });
  const fold = (text, label, call) =>
    button(
      text,
      () => {
        call();
        draw();
      },
      { class: "quiet", title: label, "aria-label": label },
    );
  const layout = el(
    "div.split.goals",
    el(
      "section.panel",
      el(
        "div.panel-head",
        el.h2("Goals"),
        counter,
        el(
          "div.tools",
          envs,
          filter.nodes,
          goneBox,
          fold("▸", "close all", () => all().forEach((goal) => closed.add(goal.key))),
          fold("▾", "open all", () => closed.clear()),
        ),
      ),
      el(
        "div.goal-heads.dim.small",
        { "aria-hidden": "true" },
        el("span.main-text", "goal"),
        COLUMNS.map((name) => el.span({ class: "c-" + name }, name)),
      ),
      empty,
      list.box,
    ),
    detail.box,
  );
  root.append(layout);

  /** What a row says besides its name, by column. */
  function cellsOf(goal) {
    const outcome = goalOutcome(goal),
      duration = durationOf(goal, app.now),
      actions = app.model.actions.get(goal.key),
      item = host.history.goals.get(goal.key),
      isBad = outcome === "failed" || outcome === "rejected",
      progress = progressOf(goal, children.get(goal.key), actions);
    return {
      outcome,
      why: isBad ? (item && reasonOf(item, host.history)) || inWords(goal.error || "") : "",
      robot: [...robotsOf(actions)].join(", "),
      done: progress ? progress.done + "/" + progress.of : "",
      began: goal.history.length ? clockText(goal.history[0].time) : "",
      took: duration ? (duration.waited ? duration.verb + " " : "") + shortTime(duration.us) : "",
    };
  }
  const shortTime = (us) => (us < 1e6 ? durationText(us) : durationText(Math.floor(us / 1e5) * 1e5));
  function drawRow(item) {
    const { goal } = item,
      { outcome, ...texts } = cellsOf(goal),
      isManyEnvs = !app.chosenEnv && app.environments.length > 1;
    return [
      el(
        "span.main-text",
        { title: goal.id },
        goal.id,
        item.inside ? el("span.dim", " +" + item.inside) : null,
        isManyEnvs ? el("span.dim", "  in " + (goal.env || MAIN_ENV)) : null,
        goal.cls && !goal.id.includes(goal.cls) ? el("span.dim", "  " + goal.cls) : null,
      ),
      el(
        "span.c-outcome",
        outcome === "completed"
          ? el("span.dim", OUTCOMES.completed.icon + " " + OUTCOMES.completed.word)
          : outcomeBadge(outcome, isOpen(outcome) ? goal.mode : undefined),
      ),
      COLUMNS.slice(1).map((name) =>
        el.span({ class: "small dim c-" + name, title: texts[name] }, texts[name]),
      ),
    ].flat();
  }
  function all() {
    const { goals, gone } = app.model,
      isGone = withGone ?? !goals.size;
    goneBox.firstChild.checked = isGone;
    const known = isGone ? [...gone.values(), ...goals.values()] : [...goals.values()];
    return app.chosenEnv ? known.filter((goal) => (goal.env || MAIN_ENV) === app.env) : known;
  }

  function draw() {
    envs.renew();
    const goals = all(),
      parents = parentsOf(goals),
      isFlat = filter.isSet;
    children = childrenOf(goals, parents);
    filter.offer(goals);
    const items = rowsOf(goals, parents, children, { isFlat, closed, fits: (goal) => filter.fits(goal) });
    counter.textContent = isFlat ? items.length + " of " + goals.length : String(goals.length);
    list.box.hidden = !items.length;
    empty.hidden = items.length > 0;
    if (!items.length) drawEmpty(goals);
    list.set(items);
  }
  function drawEmpty(goals) {
    const gone = app.model.gone.size,
      soon = app.recording
        ? "None at this moment of the recording."
        : app.goalsProblem || (gone ? "" : "They appear here as soon as the executive formulates them.");
    empty.replaceChildren(goals.length ? none("No goal matches") : none("No goals now", soon));
    const offer = (text, call) =>
      empty.firstChild.append(
        button(text, () => {
          call();
          draw();
        }),
      );
    if (goals.length && filter.isSet) offer("Show all goals", () => filter.clear());
    else if (!goals.length && gone)
      offer("Show " + (gone === 1 ? "the one that is" : "the " + gone + " that are") + " gone", () => {
        withGone = true;
      });
  }
  function drawDetail() {
    layout.classList.toggle("has-detail", Boolean(chosen));
    if (chosen) detail.draw({ goal: chosen });
  }

  const soon = paced(draw, () => app.model.goals.size + app.model.gone.size);
  const stop = app.model.onChange((topics) => {
    if (!topics.has("goals") && !topics.has("skills")) return;
    soon();
    drawDetail();
  });
  const tick = setInterval(() => {
    if (document.hidden || app.recording) return;
    if (list.items.some((item) => isOpen(goalOutcome(item.goal)))) list.update();
    drawDetail();
  }, TICK_MS);
  const follow = ({ detail: { changed, goal, time } }) => {
    if (changed.includes("time")) host.momentIs(time);
    if (changed.includes("goal") && goal !== chosen) location.replace(address(goal ? { goal } : {}));
  };
  app.addEventListener("select", follow);
  draw();
  return {
    go([key = app.selection.value.goal]) {
      filter.read();
      chosen = key;
      app.select({ goal: key });
      draw();
      list.mark(chosen, true);
      drawDetail();
    },
    close() {
      stop();
      clearInterval(tick);
      app.removeEventListener("select", follow);
      soon.stop();
      detail.close();
      list.gone();
    },
  };
}
