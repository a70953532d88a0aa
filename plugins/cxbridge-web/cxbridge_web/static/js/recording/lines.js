// Recordings that are text: lines of `cxbridge trace cat --json`.
import { KIND_OF } from "cx/recording/mcap.js";

const KINDS = new Set(Object.values(KIND_OF));
const LOOK_AT = 100;

/** @returns {events, notes}; no events: it is no recording. See mcap.js for `pause`. */
export async function readLines(text, pause) {
  const lines = text.split("\n");
  const events = [];
  let bad = 0;
  for (const [at, line] of lines.entries()) {
    if (!line.trim()) continue;
    try {
      const event = JSON.parse(line);
      if (KINDS.has(event.kind) && typeof event.time_us === "number") events.push(event);
      else bad += 1;
    } catch {
      bad += 1;
    }
    if (bad > LOOK_AT && !events.length) break;
    await pause(at / lines.length);
  }
  return {
    events,
    notes:
      bad && events.length ? [bad + (bad === 1 ? " line is not an event" : " lines are not events")] : [],
  };
}
