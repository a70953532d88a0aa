// The goals as a table, in the order of their trees, and the chosen goal beside the table.
import { escapePart } from "cx/api.js";
import { Detail } from "cx/detail.js";
import { button, checkbox, clockText, dim, durationText, el, none, plural, refill } from "cx/dom.js";
import { envSelect } from "cx/env.js";
import { forestOfGoals, rowsOf } from "cx/forest.js";
import { filterQuery, goalFilter } from "cx/goals/filter.js";
import { durationOf, progressOf, robotsOf } from "cx/goals/numbers.js";
import { MAIN_ENV } from "cx/names.js";
import { goalOutcome, isOpen, outcomeBadge, OUTCOMES } from "cx/outcome.js";
import { ListPanel } from "cx/scaffold.js";
import { inWords, reasonOf } from "cx/story/causes.js";
import { PageHost, timelineAddress } from "cx/timeline/host.js";

export const tab = { title: "Goals", order: 20 };
export const moment = "past";
export const kinds = [];
const TICK_MS = 1000, // the period of the durations of open goals
  NARROW = 760; // pixels; on a narrower page the details replace the table
const COLUMNS = ["outcome", "why", "robot", "done", "began", "took"];
const closedKeys = new Set(); // keys of goals whose children are hidden; outlives the view
let showsGone = null; // null: gone goals are shown if there are no other goals

/** The address of a goal in the table, of an action or skill call in the timeline, or of the table alone. */
function address(path) {
  if (path.action || path.skill) return timelineAddress(path);
  return path.goal
    ? "#/goals/" + escapePart(path.goal) + filterQuery()
    : "#/goals" + filterQuery({ goal: "" });
}
/** The text of a duration, cut to tenths of a second. */
const shortTime = (us) => durationText(us < 1e6 ? us : Math.floor(us / 1e5) * 1e5);
const { word, icon } = OUTCOMES.completed,
  completedText = () => dim(icon + " " + word);

export function open(root, app) {
  let chosenKey = "", // the key of a goal
    children = new Map(); // key -> goals
  const host = new PageHost(app, () => drawDetail(), address),
    detail = new Detail(host, () => drawDetail());
  detail.box.id = "goal";
  detail.box.classList.add("detail");
  const envs = envSelect(
    app,
    () => {
      app.readGoals();
      draw();
    },
    { hasAll: true },
  );
  const filter = goalFilter(app, () => draw());
  const goneBox = checkbox("past goals", false, (on) => {
    showsGone = on;
    draw();
  });
  const foldButton = (text, label, call) =>
    redrawButton(text, call, { class: "quiet", title: label, "aria-label": label });
  const heads = el(
    "div.goal-heads.dim.small",
    { "aria-hidden": "true" },
    el("span.main-text", "goal"),
    COLUMNS.map((name) => el.span({ class: "c-" + name }, name)),
  );
  const page = new ListPanel(
    {
      title: "Goals",
      before: envs,
      find: filter.nodes,
      after: [
        goneBox,
        foldButton("▸", "close all", () => listGoals().forEach((goal) => closedKeys.add(goal.key))),
        foldButton("▾", "open all", () => closedKeys.clear()),
      ],
      above: heads,
      detail: detail.box,
      row: {
        height: "--row-goal",
        key: (item) => item.goal.key,
        sign: ({ goal, ...row }) =>
          JSON.stringify([row, goal.mode, goal.outcome, goal.error, goal.cls, cellsOf(goal)]),
        draw: drawRow,
        select: (item, how) => {
          if (how !== "key" || root.clientWidth > NARROW) host.go({ goal: item.goal.key }, how === "key");
        },
        open: ({ goal: { key } }, on) => {
          closedKeys[on ? "delete" : "add"](key);
          draw();
        },
      },
    },
    draw,
  );
  const { list, life } = page;
  life.add(() => detail.close());
  page.split.classList.add("goals");
  root.append(page.split);
  /** A button whose call changes the rows. */
  function redrawButton(text, call, attributes) {
    const callAndDraw = () => {
      call();
      draw();
    };
    return button(text, callAndDraw, attributes);
  }

  /** The texts of a row besides the name, by column. */
  function cellsOf(goal) {
    const outcome = goalOutcome(goal),
      duration = durationOf(goal, app.now),
      item = host.history.goals.get(goal.key),
      isBad = outcome === "failed" || outcome === "rejected";
    return {
      outcome,
      why: isBad ? (item && reasonOf(item, host.history)) || inWords(goal.error || "") : "",
      robot: [...robotsOf(app.model, goal)].join(", "),
      done: progressOf(app.model, goal, children.get(goal.key)),
      began: duration ? clockText(duration.begin) : "",
      took: duration ? (duration.waits + " " + shortTime(duration.us)).trim() : "",
    };
  }
  function drawRow({ goal, inside }) {
    const { outcome, ...texts } = cellsOf(goal),
      hasSeveralEnvs = !app.chosenEnv && app.environments.length > 1;
    return [
      el(
        "span.main-text",
        { title: goal.id },
        goal.id,
        inside > 0 && dim(" +" + inside),
        hasSeveralEnvs && dim("  in " + (goal.env || MAIN_ENV)),
        goal.cls && !goal.id.includes(goal.cls) && dim("  " + goal.cls),
      ),
      el(
        "span.c-outcome",
        outcome === "completed"
          ? completedText()
          : outcomeBadge(outcome, isOpen(outcome) ? goal.mode : undefined),
      ),
      COLUMNS.slice(1).map((name) =>
        el.span({ class: "small dim c-" + name, title: texts[name] }, texts[name]),
      ),
    ];
  }
  /** The goals of the chosen environment, perhaps with gone goals. */
  function listGoals() {
    const { goals, gone } = app.model,
      isGoneShown = showsGone ?? !goals.size;
    goneBox.firstChild.checked = isGoneShown;
    const known = [...(isGoneShown ? gone.values() : []), ...goals.values()];
    return app.chosenEnv ? known.filter((goal) => (goal.env || MAIN_ENV) === app.env) : known;
  }

  function draw() {
    envs.renew();
    const goals = listGoals(),
      forest = forestOfGoals(goals),
      items = rowsOf(forest, { isFlat: filter.isSet, closed: closedKeys, fits: filter.fits });
    ({ children } = forest);
    filter.offer(goals);
    page.show(items, goals.length, "");
    if (!items.length) refill(page.empty, emptyTable(goals));
    // the items lack goals below closed goals: these are not left out by the filter
    if (!filter.isSet) page.count(goals.length, goals.length);
  }
  /** The box in place of an empty table: a text, and a button if there are hidden goals, which shows them. */
  function emptyTable(goals) {
    const goneCount = app.model.gone.size,
      hint = app.recording
        ? "None at this moment of the recording."
        : app.goalsProblem || (goneCount ? "" : "They appear here as soon as the executive formulates them."),
      box = goals.length ? none("No goal matches") : none("No goals now", hint);
    const showGone = () => {
      showsGone = true;
    };
    if (goals.length) box.append(redrawButton("Show all goals", () => filter.clear()));
    else if (goneCount)
      box.append(redrawButton("Show " + plural(goneCount, "goal") + " of the past", showGone));
    return box;
  }
  function drawDetail() {
    page.showDetailOf(chosenKey);
    if (chosenKey) detail.draw({ goal: chosenKey });
  }

  const drawSoon = life.paced(draw, () => app.model.goals.size + app.model.gone.size);
  life.add(
    app.model.onChange((topics) => {
      if (!topics.has("goals") && !topics.has("skills")) return;
      drawSoon();
      drawDetail();
    }),
  );
  life.every(TICK_MS, () => {
    if (app.recording) return;
    if (list.items.some((item) => isOpen(goalOutcome(item.goal)))) list.update();
    drawDetail();
  });
  // a choice in another place replaces the address, without a step in the browser's history
  life.listen(app, "select", ({ detail: { changed, goal, time } }) => {
    if (changed.includes("time")) host.takeMoment(time);
    if (changed.includes("goal") && goal !== chosenKey) location.replace(address(goal ? { goal } : {}));
  });
  draw();
  return {
    go([key = app.selection.value.goal]) {
      filter.read();
      chosenKey = key;
      app.select({ goal: key });
      draw();
      list.mark(chosenKey, true);
      drawDetail();
    },
    close: life.close,
  };
}
