// Reads recordings in the form of text: lines of `cxbridge trace cat --json`, each a JSON event.
import { KIND_OF } from "cx/recording/mcap.js";

const KINDS = new Set(Object.values(KIND_OF));
const MOST_BAD_LINES = 100; // a text that begins with more lines without an event is not a recording

/** The event of a line; null for another line. */
function eventOf(line) {
  try {
    const event = JSON.parse(line);
    return KINDS.has(event.kind) && typeof event.time_us === "number" ? event : null;
  } catch {
    return null;
  }
}

/** Read a text. @returns {events, notes}; no events: the text is not a recording. See mcap.js for `pause`. */
export async function readLines(text, pause) {
  const lines = text.split("\n").filter((line) => line.trim()),
    events = [];
  let badCount = 0;
  for (const [at, line] of lines.entries()) {
    const event = eventOf(line);
    if (event) events.push(event);
    else badCount += 1;
    if (badCount > MOST_BAD_LINES && !events.length) break;
    await pause(at / lines.length);
  }
  const remark = badCount + (badCount === 1 ? " line is not an event" : " lines are not events");
  return { events, notes: badCount && events.length ? [remark] : [] };
}
