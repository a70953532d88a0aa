// What a Skiller says of itself, and its calls up to now.
import { get } from "cx/api.js";
import { idPath } from "cx/blackboard/messages.js";
import { button, clockText, durationText, el } from "cx/dom.js";
import { skillBadge } from "cx/looks.js";

export const STATUS = "SkillerInterface::";
export const DEBUG = "SkillerDebugInterface::";
const MOST_CALLS = 50;

/** Whether a call is of a Skiller; of several agents its id is AGENT/ID. */
const isOf = (skiller) => (call) => call.skiller === skiller || call.lane === skiller;

/** As the API reported it (active, null of a recording), or as its interface was written. */
export function skillerState(model, skiller, active) {
  const call = model.calls.findLast(isOf(skiller)),
    status = model.interfaces.get(STATUS + skiller),
    debug = model.interfaces.get(DEBUG + skiller);
  const value = { text: "", status: "INACTIVE", error: "", controller: "", graph: "" };
  if (active)
    Object.assign(value, {
      text: active["skill-string"] || "",
      status: active.status,
      error: active.error,
      controller: active.exclusive_controller,
      graph: active.graph,
    });
  if (call) Object.assign(value, { text: call.text, status: call.status });
  if (status)
    Object.assign(value, {
      text: status.values.skill_string,
      status: status.values.status,
      error: status.values.error,
      controller: status.values.exclusive_controller || "",
    });
  // the same interface also has the list of skills, and machines that somebody else asked for
  if (debug && debug.values.graph_fsm === "ACTIVE" && debug.values.graph) value.graph = debug.values.graph;
  return value;
}

/** Of a Skiller that shows no graphs: what its interface has. */
export async function readStatus(skiller) {
  const { data } = await get("blackboard/interfaces/SkillerInterface/" + idPath(skiller) + "/data");
  return {
    "skill-string": data.skill_string,
    status: data.status,
    error: data.error,
    exclusive_controller: data.exclusive_controller,
    graph: "",
  };
}

/** The calls of a Skiller, the latest first. */
export const callsOf = (model, skiller) => model.calls.filter(isOf(skiller)).slice(-MOST_CALLS).reverse();

/** @param again called with the skill string of a call that is wanted again; null: nothing can be called */
export function callList(calls, again) {
  if (!calls.length) return el("p.dim", "None yet.");
  const row = (call) =>
    el.li(
      el("span.dim.n", clockText(call.begin)),
      skillBadge(call.status),
      el("code.main-text", call.text),
      el("span.dim.n", call.end === null ? "" : durationText(call.end - call.begin)),
      again
        ? button("again", () => again(call.text), { class: "quiet", "aria-label": "again: " + call.text })
        : null,
    );
  return el("ol.calls", calls.map(row));
}
