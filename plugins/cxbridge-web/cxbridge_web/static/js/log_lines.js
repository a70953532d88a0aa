// Finds the log lines that may be about a goal, action or skill call, by their robots and agents.
import { MAIN_ENV } from "cx/names.js";

// components of an agent: CLIPS (ENV), BBCLIPS|ENV, Planner|ENV, ENV/NAME
const OF_AGENT = /^(?:\w+ \((.+)\)|\w+\|(.+)|(.+)\/[^/]+)$/;
const agentOf = (component) => OF_AGENT.exec(component)?.slice(1).find(Boolean) || "";

/** The skill calls of a goal, an action or a call. */
const callsOf = ({ kind, calls, actions, ...item }) =>
  kind === "skill" ? [item] : (calls ?? actions.flatMap((action) => action.calls));
/** The names in log lines by which a call is known: its robot and its skill string. */
const namesOf = (calls) => new Set(calls.flatMap(({ skiller, text }) => [skiller, text]));

/**
 * Return a function that tells whether a log line may be about a goal, action or skill call. A line is about
 * another item if its component is of another agent, or if it names only other robots and their skill
 * strings.
 * @param from, to the time of the item in microseconds; calls at other times are not compared
 */
export function lineFilter(item, history, from, to) {
  const calls = callsOf(item),
    ownNames = namesOf(calls),
    callsMeanwhile = history.calls.filter(({ begin, end }) => begin.time <= to && (!end || end.time >= from)),
    otherNames = calls.length ? [...namesOf(callsMeanwhile)].filter((name) => !ownNames.has(name)) : [],
    envs = new Set([...history.goals.values()].map(({ env }) => env)),
    env = item.action?.env || item.env || MAIN_ENV;
  return ({ component, text }) => {
    const agent = agentOf(component),
      words = () => [...(component + " " + text).split(/[^\w-]+/), text],
      // a skill string occurs in the text, a name is one of the words
      mentions = (name) => (/[{(]/.test(name) ? text.includes(name) : words().includes(name));
    if (envs.size > 1 && envs.has(agent) && agent !== env) return false;
    return !otherNames.some(mentions) || [...ownNames].some(mentions);
  };
}
