// A Skiller: its state, its calls, its skills, the executors of its skill board, and its controller.
import { factsPath, get, idPath, part } from "cx/api.js";
import { parseFact, valuesOf } from "cx/clips/text.js";
import { badge, button, clockText, durationText, el, link, note, wideTable } from "cx/dom.js";
import { MAIN_ENV } from "cx/names.js";
import { skillBadge } from "cx/outcome.js";
import { parseCall } from "cx/skills/parameters.js";

export const STATUS = "SkillerInterface::";
export const DEBUG = "SkillerDebugInterface::";
const MOST_CALLS = 50;

/** Whether a call is of a Skiller; of several agents its id is AGENT/ID. */
const isOf = (skiller) => (call) => call.skiller === skiller || call.lane === skiller;
const ofInterface = ({ skill_string: text, status, error, exclusive_controller: controller }) => ({
  text: text || "",
  status,
  error,
  controller: controller || "",
});

/** As the API reported it (active, null of a recording), or as its interface was written. */
export function skillerState(model, skiller, active) {
  const call = model.calls.findLast(isOf(skiller)),
    status = model.interfaces.get(STATUS + skiller),
    debug = model.interfaces.get(DEBUG + skiller)?.values;
  const value = {
    ...{ text: "", status: "INACTIVE", error: "", controller: "" },
    ...(active && ofInterface({ ...active, skill_string: active["skill-string"] })),
    ...(call && { text: call.text, status: call.status }),
    ...(status && ofInterface(status.values)),
    graph: active?.graph ?? "",
  };
  // the same interface also has the list of skills, and machines that another client asked for
  if (debug?.graph_fsm === "ACTIVE" && debug.graph) value.graph = debug.graph;
  return value;
}

/** Of a Skiller that shows no graphs: what its interface has. */
export async function readStatus(skiller) {
  const { data } = await get("blackboard/interfaces/SkillerInterface/" + idPath(skiller) + "/data");
  return { ...data, "skill-string": data.skill_string, graph: "" };
}

export const callsOf = (model, skiller) => model.calls.filter(isOf(skiller)).slice(-MOST_CALLS).reverse();

/** @param again called with the skill string of a call that is wanted again; null: nothing can be called */
export function callList(calls, again) {
  const row = ({ begin, end, status, text }) =>
    el.li(
      el("span.dim.n", clockText(begin)),
      skillBadge(status),
      el("code.main-text", text),
      el("span.dim.n", end === null ? "" : durationText(end - begin)),
      again && button("again", () => again(text), { class: "quiet", "aria-label": "again: " + text }),
    );
  return calls.length ? el("ol.calls", calls.map(row)) : note("None yet.");
}

/**
 * @param names that the Skiller has
 * @param executors of its skill board, with further skills
 * @param calls its calls: of a recording, what is known of its skills; empty of a live run
 * @returns {name, who}: the executors of the skill
 */
export function knownSkills(names, executors, calls) {
  const who = new Map(names.map((name) => [name, []]));
  for (const { id, skills } of executors)
    for (const skill of skills) who.set(skill, [...(who.get(skill) || []), id]);
  for (const { text } of calls) {
    const called = parseCall(text);
    if (called && !who.has(called.skill)) who.set(called.skill, []);
  }
  return [...who]
    .map(([name, ids]) => ({ name, who: ids.join(", ") }))
    .sort((a, b) => (a.name < b.name ? -1 : 1));
}

export function noSkills({ isRecording, hasCalls, skiller, showsGraphs, hasGraph }) {
  if (isRecording && !hasCalls)
    return ["No skill called yet", "A recording shows the skills that were called up to its moment."];
  if (hasGraph || isRecording) return ["No list of skills", "The Skiller has not shown its list."];
  if (showsGraphs) return ["No skills", "The Skiller knows none, or there is no Skiller."];
  return [
    "No list of skills",
    skiller +
      " has no SkillerDebugInterface: neither its skills nor their graphs are known. It can be called.",
  ];
}

export const EXECUTOR = "SkillExecutorInterface";
const STATES = { IDLE: ["new", "○"], RESERVED: ["chosen", "◔"], BUSY: ["active", "▶"] };

/** The executors in the model's interfaces and in what the API said: [{id, agent, skills, state, skill}]. */
export function executorsOf(model, read) {
  const values = new Map(read.map((each) => [each.id, each.data]));
  for (const [uid, each] of model.interfaces) {
    const [type, id] = uid.split("::");
    if (type === EXECUTOR) values.set(id, { ...values.get(id), ...each.values });
  }
  return [...values]
    .map(([id, { agent = "", skills = "", state = "IDLE", skill = "" }]) => ({
      id,
      agent,
      skills: String(skills).split(" ").filter(Boolean),
      state: String(state),
      skill,
    }))
    .sort((a, b) => (a.agent + a.id < b.agent + b.id ? -1 : 1));
}

export function executorTable(executors) {
  const rows = executors.map(({ agent, id, skills, state, skill }) => [
    agent,
    link("#/blackboard/" + part(EXECUTOR + "::" + id), id),
    skills.map((name, at) => [at ? ", " : "", link("#/skills/" + part(name), name)]),
    [badge(...(STATES[state] || ["other", "?"]), state), skill ? [" ", el.code(skill)] : ""],
  ]);
  const table = wideTable({}, ["robot", "executor", "skills", "state"], rows);
  return el("div#executors", el.h3("Executors"), table);
}

const TEMPLATE = "skiller-control";

function controls(text, skiller) {
  const slots = parseFact(text)?.slots;
  return slots && valuesOf(slots.get("skiller"))[0] === skiller && slots.get("acquired") === "TRUE";
}

/**
 * @param serial of the interface's field exclusive_controller
 * @returns the controller in words; "" without one
 */
export async function controllerName(app, skiller, serial) {
  if (!serial) return "";
  for (const env of app.environments.length ? app.environments : [MAIN_ENV]) {
    const facts = app.recording
      ? [...app.model.factsOf(env).values()].filter((fact) => fact.template === TEMPLATE)
      : await get(factsPath(env, TEMPLATE)).catch(() => []);
    if (facts.some((fact) => controls(fact.text ?? fact.formatted, skiller)))
      return env === MAIN_ENV ? "executive" : "executive " + env;
  }
  return "another client (" + serial.slice(0, 8) + ")";
}
