// Prints the page's model of the events on stdin, with an event a line: the goals, the actions and the skill calls.
// The arguments are the folder of the page's modules, and the outcomes as JSON.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

globalThis.cx = { outcomes: JSON.parse(process.argv[3]) };
globalThis.requestAnimationFrame = () => 0;
const folder = pathToFileURL(process.argv[2] + "/");
const { Recording } = await import(new URL("recording/run.js", folder));
const { slotsIn } = await import(new URL("model.js", folder));
const events = readFileSync(0, "utf8").trimEnd().split("\n").map((line) => JSON.parse(line));
const recording = new Recording("run", events, []);
recording.goTo(events.length);
const { history, model } = recording;
const timeOf = (moment) => moment && moment.time - history.begin;
const calls = history.calls.map(({ action, guessed, env, skiller, text, msgid, status, error, begin, end }) => ({
  action: action && [action.env, action.goal, action.plan, action.id],
  guessed: Boolean(guessed),
  skiller,
  text,
  msgid,
  ran: [status, error, timeOf(begin), timeOf(end)],
}));
const goals = [...history.goals.values()].map(({ key, id, parent, changes }) => ({ key, id, parent, states: changes.map(({ mode, outcome, time }) => [mode, outcome, time - history.begin]) }));
const now = [...model.goals.values(), ...model.gone.values()].map(({ key, mode, outcome, event }) => ({ key, mode, outcome, slots: event && slotsIn(event) }));
const actions = [...history.actions.values()].map(({ env, goal, plan, id, text, changes }) => [env, goal, plan, id, changes.map(({ state }) => state), text]);
const failed = [...history.actions.values()].filter(({ changes }) => changes.at(-1).state.endsWith("FAILED")).map(({ id }) => id);
console.log(JSON.stringify({ actions, calls, failed, goals, now }));
