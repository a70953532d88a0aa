// Recordings that are text: lines of `cxbridge trace cat --json`.
import { KIND_OF } from "cx/recording/mcap.js";

const KINDS = new Set(Object.values(KIND_OF));
const LOOK_AT = 100; // a text whose first lines have no event is not a recording

function eventOf(line) {
  try {
    const event = JSON.parse(line);
    return KINDS.has(event.kind) && typeof event.time_us === "number" ? event : null;
  } catch {
    return null;
  }
}

/** @returns {events, notes}; without events, the text is not a recording. See mcap.js for `pause`. */
export async function readLines(text, pause) {
  const lines = text.split("\n").filter((line) => line.trim()),
    events = [];
  let bad = 0;
  for (const [at, line] of lines.entries()) {
    const event = eventOf(line);
    if (event) events.push(event);
    else bad += 1;
    if (bad > LOOK_AT && !events.length) break;
    await pause(at / lines.length);
  }
  const remark = bad + (bad === 1 ? " line is not an event" : " lines are not events");
  return { events, notes: bad && events.length ? [remark] : [] };
}
