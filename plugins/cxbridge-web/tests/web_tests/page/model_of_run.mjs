// Prints what the page's model makes of the events that stdin has, one a line: each skill call with its action.
// Run with the folder of the page's modules as the argument.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

globalThis.cx = {};
globalThis.requestAnimationFrame = () => 0;
const folder = pathToFileURL(process.argv[2] + "/");
const { Recording } = await import(new URL("recording/run.js", folder));
const events = readFileSync(0, "utf8").trimEnd().split("\n").map((line) => JSON.parse(line));
const recording = new Recording("run", events, []);
recording.goTo(events.length);
const { history, model } = recording;
const calls = history.calls.map(({ action, guessed, env, skiller, text, msgid }) => ({
  action: action && [action.env, action.goal, action.plan, action.id],
  guessed: Boolean(guessed),
  skiller,
  text,
  msgid,
}));
const goals = [...history.goals.values()].map(({ key, id, parent, changes }) => ({ key, id, parent, modes: changes.map(({ mode }) => mode) }));
const now = [...model.goals.values(), ...model.gone.values()].map(({ key, mode, outcome, told }) => ({ key, mode, outcome, told }));
const actions = [...history.actions.values()].map(({ env, goal, plan, id, text }) => [env, goal, plan, id, text]);
console.log(JSON.stringify({ actions, calls, goals, now }));
