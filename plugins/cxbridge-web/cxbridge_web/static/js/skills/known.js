// The skills of a Skiller by name, and why there may be none.
import { parseCall } from "cx/skills/parameters.js";

/**
 * @param names that the Skiller has
 * @param executors of its skill board: they may have others
 * @param calls its calls: of a recording, what is known of its skills; empty of a live run
 * @returns {name, who}: who executes it
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

/** Text and hint of a list without skills. */
export function noSkills({ isRecording, hasCalls, skiller, showsGraphs, hasGraph, problem, isSearch }) {
  if (isSearch) return ["No skill matches"];
  if (isRecording && !hasCalls)
    return ["No skill called yet", "A recording shows the skills that were called up to its moment."];
  if (problem) return [problem];
  if (hasGraph || isRecording) return ["No list of skills", "The Skiller has not shown its list."];
  if (showsGraphs) return ["No skills", "The Skiller knows none, or there is no Skiller."];
  return [
    "No list of skills",
    skiller +
      " has no SkillerDebugInterface: neither its skills nor their graphs are known. It can be called.",
  ];
}
