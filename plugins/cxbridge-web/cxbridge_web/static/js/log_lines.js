// Which robot, or which agent, a line of the log is about, as far as the line says so.
import { MAIN_ENV } from "cx/names.js";

// the components of an agent's environment: CLIPS (ENV), BBCLIPS|ENV, Planner|ENV; the others of the agent: ENV/NAME
const OF_AGENT = /^(?:\w+ \((.+)\)|\w+\|(.+)|(.+)\/[^/]+)$/;
const agentOf = (component) => OF_AGENT.exec(component)?.slice(1).find(Boolean) || "";

const callsOf = ({ kind, calls, actions, ...item }) =>
  kind === "skill" ? [item] : (calls ?? actions.flatMap((action) => action.calls));
const namesOf = (calls) => new Set(calls.flatMap(({ skiller, text }) => [skiller, text]));

/**
 * Whether a line may be about a goal, an action or a skill call: not if its component is of another agent, or if it
 * names another robot or the skill string of its call, and none of the item's own.
 * @param from, to the time of the item, microseconds: calls of other times are not compared
 */
export function isOfRobot(item, history, from, to) {
  const calls = callsOf(item),
    own = namesOf(calls),
    during = history.calls.filter(({ begin, end }) => begin.time <= to && (!end || end.time >= from)),
    others = calls.length ? [...namesOf(during)].filter((name) => !own.has(name)) : [],
    envs = new Set([...history.goals.values()].map(({ env }) => env)),
    env = item.action?.env || item.env || MAIN_ENV;
  return ({ component, text }) => {
    const agent = agentOf(component),
      words = () => [...(component + " " + text).split(/[^\w-]+/), text],
      names = (name) => (/[{(]/.test(name) ? text.includes(name) : words().includes(name));
    if (envs.size > 1 && envs.has(agent) && agent !== env) return false;
    return !others.some(names) || [...own].some(names);
  };
}
