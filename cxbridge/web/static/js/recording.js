// A recorded run in the same page: an mcap file, or the lines of `cxbridge trace cat --json`.
import { el } from "./dom.js";
import { isMcap, KIND_OF, readMcap } from "./mcap.js";
import { Model } from "./model.js";

const MOST_BYTES = 512 << 20, STEP_KINDS = new Set(["goal", "plan-action", "skill"]);
const KINDS = new Set(Object.values(KIND_OF));

export class Recording {
  constructor(name, events, notes) {
    this.name = name;
    this.notes = notes;
    this.model = new Model();
    this.events = events.map((event, at) => ({ event, at })).sort((a, b) => a.event.time_us - b.event.time_us || a.at - b.at).map(({ event }) => event);
    // a step is a transition; without any, each event is one
    this.steps = this.events.flatMap((event, at) => (STEP_KINDS.has(event.kind) ? [at + 1] : []));
    if (!this.steps.length) this.steps = this.events.map((_, at) => at + 1);
    this.at = 0;  // events that have happened
    this.listeners = new Set();
  }

  get begin() { return this.events.length ? this.events[0].time_us : 0; }
  get end() { return this.events.length ? this.events[this.events.length - 1].time_us : 0; }
  get time() { return this.at ? this.events[this.at - 1].time_us : this.begin; }
  /** How many steps have happened. */
  get stepNumber() {
    let low = 0, high = this.steps.length;
    while (low < high) { const middle = (low + high) >> 1; if (this.steps[middle] <= this.at) low = middle + 1; else high = middle; }
    return low;
  }

  goTo(count) {
    const wanted = Math.max(0, Math.min(this.events.length, count));
    if (wanted < this.at) { this.model.clear(); this.at = 0; }
    while (this.at < wanted) this.model.apply(this.events[this.at++]);
    for (const listener of this.listeners) listener();
  }
  goToStep(number) { this.goTo(number <= 0 ? 0 : number >= this.steps.length ? this.events.length : this.steps[number - 1]); }
  step(by) { this.goToStep(this.stepNumber + by); }

  /** The last step that happened, in words. */
  get line() {
    const event = this.at ? this.events[this.steps[Math.max(0, this.stepNumber - 1)] - 1] : null;
    if (!event || !this.stepNumber) return "the begin";
    if (event.kind === "goal") return "goal " + event.goal + " " + event.mode + (event.outcome === "UNKNOWN" ? "" : " " + event.outcome);
    if (event.kind === "plan-action") return "action " + event.action + " of " + event.goal + " " + event.state;
    if (event.kind === "skill") return "skill " + (event.skill_string || "none") + " " + event.status;
    return event.kind;
  }
}

export async function openFile(app, file) {
  if (file.size > MOST_BYTES) { app.toast(file.name + " is too big for a browser: cxbridge trace report makes a page of it", true); return; }
  const bytes = new Uint8Array(await file.arrayBuffer());
  const { events, notes } = isMcap(bytes) ? readMcap(bytes) : readLines(new TextDecoder().decode(bytes));
  if (!events.length) { app.toast(file.name + ": no events. An mcap file of cxbridge, or lines of 'cxbridge trace cat --json'", true); return; }
  const recording = new Recording(file.name, events, notes);
  recording.goTo(events.length);
  app.look(recording);
  for (const note of notes) app.toast(note, true);
}

function readLines(text) {
  const events = [];
  let bad = 0;
  for (const line of text.split("\n")) {
    if (!line.trim()) continue;
    try {
      const event = JSON.parse(line);
      if (KINDS.has(event.kind) && typeof event.time_us === "number") events.push(event); else bad += 1;
    } catch { bad += 1; }
    if (bad > 100 && !events.length) break;
  }
  return { events, notes: bad && events.length ? [bad + " lines are no events"] : [] };
}

export function chooseFile(app) {
  let input = document.getElementById("recording-file");
  if (!input) {
    input = el("input", { type: "file", id: "recording-file", hidden: true, accept: ".mcap,.json,.jsonl,.ndjson" });
    input.addEventListener("change", () => {
      if (input.files.length) openFile(app, input.files[0]);
      input.value = "";  // the same file may be chosen again
    });
    document.body.append(input);
  }
  input.click();
}

export function dropZone(app) {
  const zone = document.getElementById("drop");
  let depth = 0;
  const isFile = (event) => event.dataTransfer && [...event.dataTransfer.types].includes("Files");
  document.addEventListener("dragenter", (event) => { if (isFile(event)) { depth += 1; zone.hidden = false; } });
  document.addEventListener("dragleave", () => { depth = Math.max(0, depth - 1); zone.hidden = depth === 0; });
  document.addEventListener("dragover", (event) => { if (isFile(event)) event.preventDefault(); });
  document.addEventListener("drop", (event) => {
    if (!isFile(event)) return;
    event.preventDefault();
    depth = 0;
    zone.hidden = true;
    if (event.dataTransfer.files.length) openFile(app, event.dataTransfer.files[0]);
  });
}
