// The forest of goals, and beside it the chosen goal (what it is, its plans, how it came here, why) or the run.
import { get, part, throttled } from "cx/api.js";
import { button, checkbox, durationText, el, none, paced, panel, refill, search } from "cx/dom.js";
import { envSelect, readOf } from "cx/env.js";
import { parentsOf } from "cx/forest.js";
import { goalDetail } from "cx/goals/detail.js";
import { goalFilter } from "cx/goals/filter.js";
import { durationOf, progressOf, robotsOf } from "cx/goals/numbers.js";
import { runSummary } from "cx/goals/summary.js";
import { childrenOf, rowsOf } from "cx/goals/tree.js";
import { goalWhy } from "cx/goals/why.js";
import { goalText } from "cx/looks.js";
import { MAIN_ENV } from "cx/model.js";
import { goalOutcome, isOpen, OUTCOMES } from "cx/outcome.js";
import { VirtualList } from "cx/virtual.js";

export const tab = { title: "Goals", order: 20 };
export const moment = "past";
export const kinds = [];
const PLANS_MS = 1000,
  TICK_MS = 1000,
  SUMMARY_MS = 700,
  SUMMARY_OF_MANY_MS = 3000,
  MANY = 500;
const closed = new Set(); // stays when another view was open
let withGone = null; // null: while there are no others

export function open(root, app) {
  let wanted = "",
    chosen = "",
    plans = null,
    plansOf = "",
    why = null,
    seenState = "",
    children = new Map();
  const href = (key) => "#/goals/" + part(key);
  const list = new VirtualList({
    label: "Goals",
    height: "--row-goal",
    key: (item) => item.goal.key,
    sign: (item) =>
      [
        item.depth,
        item.open,
        item.inside,
        item.goal.mode,
        item.goal.outcome,
        item.goal.error,
        item.goal.cls,
        item.goal.subType,
        JSON.stringify(numbers(item.goal)),
      ].join("|"),
    draw: drawRow,
    select: (item, how) => {
      if (how !== "key" || root.clientWidth > 760) location.hash = href(item.goal.key);
    },
    open: (item, on) => {
      if (on) closed.delete(item.goal.key);
      else closed.add(item.goal.key);
      draw();
    },
  });
  const counter = el("span", { class: "dim count" });
  const empty = el("div", { hidden: true });
  const detail = el("div", { class: "detail", id: "goal" });
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
  const tools = [
    search("Search goals", (text) => {
      wanted = text;
      draw();
    }),
    filter.nodes,
    goneBox,
    fold("▸ all", "close all", () => all().forEach((goal) => closed.add(goal.key))),
    fold("▾ all", "open all", () => closed.clear()),
  ];
  const layout = el(
    "div",
    { class: "split" },
    panel("Goals", [envs, counter, tools], empty, list.box),
    detail,
  );
  root.append(layout);

  function numbers(goal) {
    const duration = durationOf(goal, app.now),
      actions = app.model.actions.get(goal.key);
    return {
      progress: progressOf(goal, children.get(goal.key), actions),
      robots: [...robotsOf(actions)],
      time: duration && (duration.waited ? duration.verb + " " : "") + shortTime(duration.us),
    };
  }
  const shortTime = (us) => (us < 1e6 ? durationText(us) : durationText(Math.floor(us / 1e5) * 1e5));
  function drawRow(item) {
    const { goal } = item,
      outcome = goalOutcome(goal),
      { progress, robots, time } = numbers(goal);
    return [
      el("i", { class: "dot outcome o-" + outcome, "aria-hidden": "true" }, OUTCOMES[outcome].icon),
      el(
        "span",
        { class: "main-text" },
        goal.id,
        item.inside ? el("span", { class: "dim" }, " +" + item.inside) : null,
        !app.chosenEnv && app.environments.length > 1
          ? el("span", { class: "dim" }, "  in " + (goal.env || MAIN_ENV))
          : null,
        goal.cls && goal.cls !== goal.id ? el("span", { class: "dim" }, "  " + goal.cls) : null,
      ),
      goal.error ? el("span", { class: "bad-text" }, goal.error) : null,
      robots.length ? el("span", { class: "dim small wide-only" }, robots.join(", ")) : null,
      progress ? progressBar(progress) : null,
      time ? el("span", { class: "dim small n time" }, time) : null,
      el("span", { class: "word" }, goalText(goal)),
    ];
  }
  function progressBar({ done, of }) {
    const bar = el("i", { class: "bar", "aria-hidden": "true" });
    bar.style.setProperty("--part", of ? done / of : 0);
    return el("span", { class: "progress small dim n" }, bar, done + "/" + of);
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
      isFlat = wanted !== "" || filter.isSet;
    children = childrenOf(goals, parents);
    filter.offer(goals);
    const items = rowsOf(goals, parents, children, {
      isFlat,
      closed,
      fits: (goal) =>
        filter.fits(goal) &&
        (!wanted ||
          [goal.id, goal.cls, goalText(goal), goal.error, goal.subType]
            .join(" ")
            .toLowerCase()
            .includes(wanted)),
    });
    counter.textContent = isFlat ? items.length + " of " + goals.length : String(goals.length);
    list.box.hidden = !items.length;
    empty.hidden = items.length > 0;
    if (!items.length) drawEmpty(goals);
    list.set(items);
  }
  function drawEmpty(goals) {
    const gone = app.model.gone.size;
    empty.replaceChildren(
      goals.length
        ? none("No goal matches")
        : none(
            "No goals now",
            app.recording
              ? "None at this moment of the recording."
              : app.goalsProblem ||
                  (gone ? "" : "They appear here as soon as the executive formulates them."),
          ),
    );
    const offer = (text, call) =>
      empty.firstChild.append(
        button(text, () => {
          call();
          draw();
        }),
      );
    if (goals.length && filter.isSet) offer("Show all outcomes, classes and robots", () => filter.clear());
    else if (!goals.length && gone)
      offer("Show " + (gone === 1 ? "the one that is" : "the " + gone + " that are") + " gone", () => {
        withGone = true;
      });
  }

  const goalOf = (key) => app.model.goals.get(key) || app.model.gone.get(key);
  const isMain = (goal) => !goal.env || goal.env === MAIN_ENV;
  const readPlans = throttled(
    async () => {
      const key = chosen,
        goal = goalOf(key);
      if (!goal || app.recording) return;
      const read = isMain(goal)
        ? app.model.goals.has(key)
          ? await readMainPlans(goal)
          : []
        : (await readOf(goal.env, "plans")).filter((plan) => plan["goal-id"] === goal.name);
      if (key !== chosen) return;
      if (read.length) {
        plans = read;
        plansOf = key;
      }
      drawDetail();
    },
    PLANS_MS,
    () => {},
  );
  async function readMainPlans(goal) {
    const details = await get("clips-executive/goals/" + part(goal.name));
    goal.details = details;
    return Promise.all(
      (details.plans || []).map((plan) => get("clips-executive/plans/" + part(goal.name) + "/" + part(plan))),
    );
  }

  async function askWhy() {
    const key = chosen,
      goal = goalOf(key);
    const show = (node) => {
      why = { key, node };
      drawn = "";
      if (chosen === key) drawDetail();
    };
    show(el("p", { class: "dim" }, "…"));
    try {
      const answer = await get("cxbridge/why?goal=" + part(goal.id));
      show(goalWhy(app, answer.data));
    } catch (error) {
      show(el("p", { class: "error-box" }, error.message));
    }
  }

  let drawn = "",
    summaryAt = -Infinity,
    summaryOf = 0,
    summaryLater = 0;
  function drawSummary() {
    const size = app.model.goals.size + app.model.gone.size,
      pause = size > MANY ? SUMMARY_OF_MANY_MS : SUMMARY_MS;
    if (drawn === "summary" && performance.now() - summaryAt < pause) {
      summaryLater ||= setTimeout(() => {
        summaryLater = 0;
        drawDetail();
      }, pause);
      return;
    }
    // a reader there is not disturbed, unless what is read is not true any more
    if (drawn === "summary" && summaryOf && detail.contains(document.activeElement)) return;
    const goals = [...app.model.gone.values(), ...app.model.goals.values()];
    drawn = "summary";
    summaryAt = performance.now();
    summaryOf = size;
    refill(detail, runSummary(app, goals, parentsOf(goals)));
  }
  function drawDetail() {
    layout.classList.toggle("has-detail", Boolean(chosen));
    layout.classList.toggle("with-run", !chosen);
    const goal = chosen && goalOf(chosen);
    if (!chosen) {
      drawSummary();
      return;
    }
    if (!goal) {
      drawn = "";
      refill(detail, none("There is no goal " + chosen, "It is not there any more, or not yet."));
      return;
    }
    const states = app.model.actions.get(goal.key) || new Map(),
      { action } = app.selection.value;
    const next = JSON.stringify([
      [goal.key, goal.mode, goal.outcome, goal.error, goal.history.length],
      goal.details,
      [...states.values()].map((each) => [each.id, each.state, each.skiller]),
      plansOf === goal.key && plans,
      why && why.key,
      [action, durationOf(goal, app.now)],
    ]);
    if (next === drawn) return;
    drawn = next;
    refill(
      detail,
      goalDetail(app, goal, {
        plans: plansOf === goal.key ? plans : null,
        why: why && why.key === goal.key ? why.node : null,
        askWhy: !app.recording && isMain(goal) ? askWhy : null,
        children: children.get(goal.key) || [],
      }),
    );
  }

  const soon = paced(draw, () => app.model.goals.size + app.model.gone.size);
  const stop = app.model.onChange((topics) => {
    if (!topics.has("goals") && !topics.has("skills")) return;
    soon();
    const goal = goalOf(chosen),
      states = [...(app.model.actions.get(chosen) || new Map()).values()].map((each) => each.state);
    const now = [chosen, goal ? goal.mode : "", ...states].join(" ");
    if (chosen && now !== seenState) {
      seenState = now;
      readPlans();
    }
    drawDetail();
  });
  const tick = setInterval(() => {
    if (document.hidden || app.recording) return;
    if (list.items.some((item) => isOpen(goalOutcome(item.goal)))) list.update();
    drawDetail();
  }, TICK_MS);
  function showAction() {
    drawDetail();
    const { action } = app.selection.value;
    if (action) document.getElementById("action-" + action)?.scrollIntoView({ block: "nearest" });
  }
  const follow = ({ detail: { changed, goal } }) => {
    if (changed.includes("goal") && goal !== chosen) location.replace(goal ? href(goal) : "#/goals");
    else if (changed.includes("action")) showAction();
  };
  app.addEventListener("select", follow);
  draw();
  return {
    go([key = app.selection.value.goal]) {
      if (key !== chosen) {
        chosen = key;
        app.select({ goal: key });
        plans = null;
        why = null;
        drawn = "";
        readPlans();
      }
      list.mark(chosen, true);
      showAction();
    },
    close() {
      stop();
      clearInterval(tick);
      clearTimeout(summaryLater);
      app.removeEventListener("select", follow);
      soon.stop();
      readPlans.stop();
      list.gone();
    },
  };
}
