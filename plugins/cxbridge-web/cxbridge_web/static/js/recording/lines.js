// Recordings that are text: lines of `cxbridge trace cat --json`, and logs in the layout of Fawkes'.
import { KIND_OF } from "cx/recording/mcap.js";

const KINDS = new Set(Object.values(KIND_OF));
const LOG = /^([DIWE]) (\d\d):(\d\d):(\d\d)\.(\d{6}) ([^:]*(?::(?! )[^:]*)*): (.*)$/s;
const HALF_DAY_US = 43200e6,
  LOOK_AT = 100;

/** @returns {events, notes}; no events: it is neither. See mcap.js for `pause`. */
export async function readLines(text, pause) {
  const lines = text.split("\n");
  return lines.slice(0, LOOK_AT).some((line) => LOG.test(line))
    ? readLog(lines, pause)
    : readJson(lines, pause);
}

async function readJson(lines, pause) {
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

/** A log tells the time of day only: the day is made up, and a new one begins at midnight. */
async function readLog(lines, pause) {
  const events = [];
  let day = new Date(2000, 0, 1).getTime() * 1000,
    last = 0;
  for (const [at, line] of lines.entries()) {
    const found = LOG.exec(line);
    if (!found) {
      if (line && events.length) events[events.length - 1].text += "\n" + line;
      continue;
    }
    const [, level, hours, minutes, seconds, micros, component, text] = found;
    let time = day + ((hours * 60 + Number(minutes)) * 60 + Number(seconds)) * 1e6 + Number(micros);
    if (time < last - HALF_DAY_US) {
      day += 2 * HALF_DAY_US;
      time += 2 * HALF_DAY_US;
    }
    last = time;
    events.push({ kind: "log", time_us: time, level, component, text });
    await pause(at / lines.length);
  }
  return {
    events,
    notes: [
      "Of a text log only the lines are shown, in Log. 'cxbridge trace convert' makes an mcap of it, with goals and skills as far as it tells them.",
    ],
  };
}
