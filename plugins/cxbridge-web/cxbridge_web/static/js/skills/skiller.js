// A Skiller: its state, its calls, its skills, and the executors of its skill board.
import { get, idPath } from "cx/api.js";
import { clockText, durationText, el, note } from "cx/dom.js";
import { skillOf } from "cx/names.js";
import { skillBadge } from "cx/outcome.js";

export const STATUS = "SkillerInterface::";
export const DEBUG = "SkillerDebugInterface::";
const MOST_CALLS = 50; // in a list

/** A test of calls: whether a call is of a Skiller; with several agents the Skiller's id is AGENT/ID. */
const isOf = (skiller) => (call) => call.skiller === skiller || call.lane === skiller;
/** The state in the values of a SkillerInterface. */
const stateOf = ({ skill_string: text, status, error, exclusive_controller: controller }) => ({
  text: text || "",
  status,
  error,
  controller: controller || "",
});

/**
 * The state of a Skiller, {text, status, error, controller, graph}: events are newer than the answer of the
 * API.
 * @param active the answer of the API about the active skill; null: only events count
 */
export function skillerState(model, skiller, active) {
  const call = model.calls.findLast(isOf(skiller)),
    skillerInterface = model.interfaces.get(STATUS + skiller),
    debug = model.interfaces.get(DEBUG + skiller)?.values;
  const state = {
    ...{ text: "", status: "INACTIVE", error: "", controller: "" },
    ...(active && stateOf({ ...active, skill_string: active["skill-string"] })),
    ...(call && { text: call.text, status: call.status }),
    ...(skillerInterface && stateOf(skillerInterface.values)),
    graph: active?.graph ?? "",
  };
  // the interface also holds the list of skills, and graphs that other clients asked for
  if (debug?.graph_fsm === "ACTIVE" && debug.graph) state.graph = debug.graph;
  return state;
}

/**
 * Read the state of a Skiller without SkillerDebugInterface, in the form of the API's answer: see
 * skillerState().
 */
export async function readStatus(skiller) {
  const { data } = await get("blackboard/interfaces/SkillerInterface/" + idPath(skiller) + "/data");
  return { ...data, "skill-string": data.skill_string, graph: "" };
}

/** The latest MOST_CALLS calls of a Skiller, or of one of its skills, the last call first. */
export const callsOf = (model, skiller, skill = "") =>
  model.calls
    .filter((call) => isOf(skiller)(call) && (!skill || skillOf(call.text) === skill))
    .slice(-MOST_CALLS)
    .reverse();

/** The list of calls, each with its time, status, text and duration. */
export function callList(calls) {
  const row = ({ begin, end, status, text }) =>
    el.li(
      el("span.dim.n", clockText(begin)),
      skillBadge(status),
      el("code.main-text", text),
      el("span.dim.n", end === null ? "" : durationText(end - begin)),
    );
  return calls.length ? el("ol.calls", calls.map(row)) : note("None yet.");
}

/**
 * All skills of a Skiller, sorted by name.
 * @param names the skills that the Skiller lists
 * @param executors the executors of its skill board: {id, skills}
 * @param calls its calls, the last call first
 * @returns {name, executorText, status}: the ids of the skill's executors, and the status of its last call;
 * undefined without a call
 */
export function knownSkills(names, executors, calls) {
  const executorIds = new Map(names.map((name) => [name, []])), // by skill
    lastStatus = new Map(calls.toReversed().map(({ text, status }) => [skillOf(text), status]));
  for (const { id, skills } of executors)
    for (const skill of skills) executorIds.set(skill, [...(executorIds.get(skill) || []), id]);
  return [...new Set([...executorIds.keys(), ...lastStatus.keys()])].sort().map((name) => ({
    name,
    executorText: (executorIds.get(name) || []).join(", "),
    status: lastStatus.get(name),
  }));
}

export const EXECUTOR = "SkillExecutorInterface";

/** The executors, {id, agent, skills}, in an answer of the API and in the events, which are newer. */
export function executorsOf(model, answer) {
  const values = new Map(answer.map(({ id, data }) => [id, data]));
  for (const [uid, known] of model.interfaces) {
    const [type, id] = uid.split("::");
    if (type === EXECUTOR) values.set(id, known.values);
  }
  return [...values].map(([id, { agent = "", skills = "" }]) => ({
    id,
    agent,
    skills: String(skills).split(" ").filter(Boolean),
  }));
}
