// The executors of the skill board (docs/skill-board.md): who they are, what they can do, what they do now.
import { part } from "cx/api.js";
import { badge, el, link, wideTable } from "cx/dom.js";

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
