// The forest of goals, and the chosen goal: what it is, its plans, how it came here, why.
import { get, part, throttled } from "../api.js";
import {
  button,
  checkbox,
  clockText,
  durationText,
  el,
  none,
  paced,
  pairs,
  panel,
  refill,
  search,
} from "../dom.js";
import { actionBadge, actionLook, goalBadge, goalLook, goalText } from "../looks.js";
import { envSelect, readOf } from "../env.js";
import { MAIN_ENV } from "../model.js";
import { VirtualList } from "../virtual.js";

export const tab = { title: "Goals", order: 20 };
export const kinds = [];
const PLANS_MS = 1000;
const closed = new Set(); // stays when another view was open
let withGone = false;

// The parent of each goal that is there, "" for roots. Of goals that are each other's parents the first is
// a root.
function parentsOf(goals) {
  const there = new Set(goals.map((goal) => goal.key)),
    settled = new Set();
  const parents = new Map(goals.map((goal) => [goal.key, there.has(goal.parent) ? goal.parent : ""]));
  for (const goal of goals) {
    const path = new Set();
    let at = goal.key;
    while (at && !settled.has(at) && !path.has(at)) {
      path.add(at);
      at = parents.get(at);
    }
    if (path.has(at)) {
      const way = [...path],
        ring = new Set(way.slice(way.indexOf(at)));
      parents.set(goals.find((each) => ring.has(each.key)).key, "");
    }
    for (const each of path) settled.add(each);
  }
  return parents;
}

export function open(root, app) {
  let wanted = "",
    chosen = "",
    plans = null,
    plansOf = "",
    why = null,
    seenState = "";
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
  const told = el("span", { class: "dim count" });
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
  const goneBox = checkbox("gone too", withGone, (on) => showGone(on));
  const tools = [
    search("Search goals", (text) => {
      wanted = text;
      draw();
    }),
    goneBox,
    button(
      "▸ all",
      () => {
        for (const goal of all()) closed.add(goal.key);
        draw();
      },
      { class: "quiet", title: "close all", "aria-label": "close all" },
    ),
    button(
      "▾ all",
      () => {
        closed.clear();
        draw();
      },
      { class: "quiet", title: "open all", "aria-label": "open all" },
    ),
  ];
  const layout = el("div", { class: "split" }, panel("Goals", [envs, told, tools], empty, list.box), detail);
  root.append(layout);

  function drawRow(item) {
    const { goal } = item,
      look = goalLook(goal);
    return [
      el("i", { class: "dot t-" + look[0], "aria-hidden": "true" }, look[1]),
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
      goal.subType ? el("span", { class: "dim small wide-only" }, goal.subType) : null,
      el("span", { class: "word" }, goalText(goal)),
    ];
  }
  function showGone(on) {
    withGone = on;
    goneBox.firstChild.checked = on;
    draw();
  }
  function all() {
    const goals = withGone
      ? [...app.model.gone.values(), ...app.model.goals.values()]
      : [...app.model.goals.values()];
    return app.chosenEnv ? goals.filter((goal) => (goal.env || MAIN_ENV) === app.env) : goals;
  }

  function draw() {
    envs.renew();
    const goals = all(),
      parents = parentsOf(goals),
      children = new Map(),
      roots = [];
    for (const goal of goals) {
      const parent = parents.get(goal.key);
      if (parent) {
        if (!children.has(parent)) children.set(parent, []);
        children.get(parent).push(goal);
      } else roots.push(goal);
    }
    const fits = (goal) =>
      !wanted ||
      [goal.id, goal.cls, goalText(goal), goal.error, goal.subType].join(" ").toLowerCase().includes(wanted);
    const items = [];
    const below = (goal) => {
      let count = 0;
      const stack = [goal];
      while (stack.length) {
        const kids = children.get(stack.pop().key) || [];
        count += kids.length;
        if (count > 9999) break;
        stack.push(...kids);
      }
      return count;
    };
    const stack = roots.reverse().map((goal) => [goal, 0]);
    while (stack.length) {
      const [goal, depth] = stack.pop();
      const kids = children.get(goal.key);
      const isOpen = kids ? wanted !== "" || !closed.has(goal.key) : null;
      if (fits(goal)) {
        items.push({
          goal,
          depth: wanted ? 0 : depth,
          open: wanted ? null : isOpen,
          inside: isOpen === false ? below(goal) : 0,
          rowClass: goal.mode === "RETRACTED" ? "later" : "",
        });
      }
      if (isOpen) for (let at = kids.length - 1; at >= 0; at--) stack.push([kids[at], depth + 1]);
    }
    told.textContent = wanted ? items.length + " of " + goals.length : String(goals.length);
    list.box.hidden = !items.length;
    empty.hidden = items.length > 0;
    if (!items.length) {
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
      if (!goals.length && gone)
        empty.firstChild.append(
          button("Show " + (gone === 1 ? "the one that is" : "the " + gone + " that are") + " gone", () =>
            showGone(true),
          ),
        );
    }
    list.set(items);
  }

  const goalOf = (key) => app.model.goals.get(key) || app.model.gone.get(key);
  const isMain = (goal) => !goal.env || goal.env === MAIN_ENV;
  const readPlans = throttled(
    async () => {
      const key = chosen,
        goal = goalOf(key);
      if (!goal || app.recording) return;
      if (!isMain(goal)) {
        const read = (await readOf(goal.env, "plans")).filter((plan) => plan["goal-id"] === goal.id);
        if (read.length && key === chosen) {
          plans = read;
          plansOf = key;
        }
      } else if (app.model.goals.has(key)) {
        const details = await get("clips-executive/goals/" + part(goal.id));
        const read = await Promise.all(
          (details.plans || []).map((plan) =>
            get("clips-executive/plans/" + part(goal.id) + "/" + part(plan)),
          ),
        );
        goal.details = details;
        if (read.length) {
          plans = read;
          plansOf = key;
        }
      }
      if (key === chosen) drawDetail();
    },
    PLANS_MS,
    () => {},
  );

  /** The plans of the chosen goal: as the API tells them, their states as the last events told them. */
  function planList(goal) {
    const states = app.model.actions.get(goal.key) || new Map();
    if (plansOf === goal.key && plans) {
      return plans.map((plan) => ({
        id: plan.id,
        cost: plan.cost,
        actions: plan.actions.map((action) => ({
          id: action.id,
          name: action["operator-name"],
          values: action["param-values"],
          executable: action.executable,
          duration: action.duration,
          state: (states.get(plan.id + " " + action.id) || action).state,
        })),
      }));
    }
    const byPlan = new Map();
    for (const action of states.values()) {
      if (!byPlan.has(action.plan)) byPlan.set(action.plan, []);
      byPlan.get(action.plan).push({ id: action.id, name: action.name, values: [], state: action.state });
    }
    for (const actions of byPlan.values()) actions.sort((a, b) => Number(a.id) - Number(b.id));
    return [...byPlan].map(([id, actions]) => ({ id, actions }));
  }

  function drawPlan(plan) {
    const row = (action) => {
      const look = actionLook(action.state);
      return el(
        "li",
        { class: "action" },
        el("i", { class: "dot t-" + look[0], "aria-hidden": "true" }, look[1]),
        el("span", { class: "dim num" }, String(action.id)),
        el(
          "code",
          { class: "main-text" },
          el("b", {}, action.name),
          action.values.length ? " " + action.values.join(" ") : "",
        ),
        action.executable && ["FORMULATED", "PENDING"].includes(action.state)
          ? el("span", { class: "dim small" }, "executable")
          : null,
        actionBadge(action.state),
      );
    };
    const done = plan.actions.filter((action) => action.state === "FINAL").length;
    return el(
      "div",
      { class: "plan" },
      el(
        "h3",
        {},
        "Plan ",
        el("code", {}, plan.id),
        el(
          "span",
          { class: "dim" },
          "  " + done + " of " + plan.actions.length + " done" + (plan.cost > 0 ? ", cost " + plan.cost : ""),
        ),
      ),
      plan.actions.length
        ? el("ol", { class: "actions" }, plan.actions.map(row))
        : el("p", { class: "dim" }, "without actions"),
    );
  }

  function drawHistory(goal) {
    if (!goal.history.length) return null;
    const first = goal.history[0].time;
    return el(
      "div",
      {},
      el("h3", {}, "How it came here"),
      el(
        "ol",
        { class: "history" },
        goal.history.map((step, at) =>
          el(
            "li",
            {},
            el("span", { class: "dim n" }, at ? "+" + durationText(step.time - first) : clockText(step.time)),
            " ",
            goalBadge(step),
            step.error ? el("span", { class: "bad-text" }, " " + step.error) : null,
          ),
        ),
      ),
    );
  }

  async function askWhy() {
    const key = chosen,
      goal = goalOf(key);
    why = { key, lines: ["…"] };
    drawDetail();
    try {
      const answer = await get("cxbridge/why?goal=" + part(goal.id));
      why = { key, lines: answer.lines };
    } catch (error) {
      why = { key, lines: [error.message] };
    }
    if (chosen === key) drawDetail();
  }

  let drawn = "";
  function drawDetail() {
    layout.classList.toggle("has-detail", Boolean(chosen));
    const goal = chosen && goalOf(chosen);
    if (!goal) {
      refill(
        detail,
        none(
          chosen ? "There is no goal " + chosen : "Choose a goal",
          chosen
            ? "It is not there any more, or not yet."
            : "Its plans, its history and its why are shown here.",
        ),
      );
      drawn = "";
      return;
    }
    const details = goal.details || {},
      list = planList(goal);
    const next = JSON.stringify([
      goal.key,
      goal.mode,
      goal.outcome,
      goal.error,
      goal.history.length,
      details,
      list,
      why,
    ]);
    if (next === drawn) return;
    drawn = next;
    const parent = goal.parent ? el("a", { href: href(goal.parent) }, goal.parent) : "";
    const words = (values) => (values || []).join(" ");
    refill(
      detail,
      el(
        "div",
        { class: "detail-head" },
        el("a", { class: "back", href: "#/goals?goal=", "aria-label": "back to the goals" }, "←"),
        el("h2", {}, goal.id),
        goalBadge(goal),
        !app.recording && isMain(goal)
          ? button("Why?", askWhy, { id: "why", title: "how it came to this" })
          : null,
      ),
      goal.error ? el("p", { class: "error-box" }, goal.error) : null,
      pairs([
        ["class", goal.cls],
        ["type", details.type],
        ["sub-type", goal.subType],
        ["parent", parent],
        ["priority", details.priority === undefined ? "" : String(details.priority)],
        ["parameters", words(details.parameters)],
        ["meta", words(details.meta)],
        ["message", details.message],
        ["required", words(details["required-resources"])],
        ["acquired", words(details["acquired-resources"])],
        ["environment", goal.env === MAIN_ENV ? "" : goal.env],
      ]),
      why && why.key === goal.key
        ? el("div", {}, el("h3", {}, "Why"), el("pre", { id: "why-text" }, why.lines.join("\n")))
        : null,
      list.length
        ? list.map(drawPlan)
        : el("p", { class: "dim" }, "No plan" + (goal.subType ? ": it is " + goal.subType : "") + "."),
      drawHistory(goal),
    );
  }

  const soon = paced(draw, () => app.model.goals.size + (withGone ? app.model.gone.size : 0));
  const stop = app.model.onChange((topics) => {
    if (!topics.has("goals")) return;
    soon();
    if (!chosen) return;
    const goal = goalOf(chosen),
      states = [...(app.model.actions.get(chosen) || new Map()).values()].map((each) => each.state);
    const now = [chosen, goal ? goal.mode : "", ...states].join(" ");
    if (now !== seenState) {
      seenState = now;
      readPlans();
    }
    drawDetail();
  });
  const follow = ({ detail: { changed, goal } }) => {
    if (changed.includes("goal") && goal !== chosen) location.replace(goal ? href(goal) : "#/goals");
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
      drawDetail();
    },
    close() {
      stop();
      app.removeEventListener("select", follow);
      soon.stop();
      readPlans.stop();
      list.gone();
    },
  };
}
