// The samples of a series. Texts become levels, numbered in the order of their first samples.
import { countWhile } from "cx/names.js";

const FIRST_ROOM = 1024, // samples that a new series has room for
  MOST_SAMPLES = 200_000; // of a live series, in 3 MB; the oldest quarter makes room
const NO_VALUE = new Set(["", "nil", "undefined", "null"]);
const TRUTH_VALUES = { TRUE: 1, FALSE: 0, true: 1, false: 0 };

/** A value as a number, a truth value as 1 or 0; NaN for no value, undefined for any other text. */
function numberOf(value) {
  if (typeof value === "number") return value;
  if (typeof value === "boolean") return Number(value);
  const text = String(value);
  if (NO_VALUE.has(text)) return NaN;
  if (text in TRUTH_VALUES) return TRUTH_VALUES[text];
  const number = Number(text);
  return Number.isFinite(number) ? number : undefined;
}

export class Series {
  constructor(source, mostSamples = MOST_SAMPLES) {
    // words: the levels; null for numbers
    Object.assign(this, { source, mostSamples, count: 0, words: null });
    this.times = new Float64Array(FIRST_ROOM);
    this.values = new Float64Array(FIRST_ROOM);
    this.colourNumber = 0; // in the palette's `series`
  }

  get name() {
    return this.source.name;
  }
  get isStep() {
    return this.source.isStep || this.words !== null;
  }

  /** Add the sample of an event. Returns whether the event has one. */
  take(event) {
    const value = this.source.sample(event);
    if (value === undefined) return false;
    this.push(event.time_us, value);
    return true;
  }

  push(time, value) {
    // the clock was set back: the sample is dropped, because searches need ascending times
    if (this.count && time < this.times[this.count - 1]) return;
    let number = this.words ? undefined : numberOf(value);
    if (number === undefined) {
      this.words ??= [];
      const word = String(value);
      number = this.words.indexOf(word);
      if (number < 0) number = this.words.push(word) - 1;
    }
    if (this.count === this.times.length) this.grow();
    this.times[this.count] = time;
    this.values[this.count++] = number;
  }

  /** Make room for samples: twice the room, or the room of the oldest quarter of a full series. */
  grow() {
    if (this.count >= this.mostSamples) {
      const droppedCount = this.count >> 2;
      this.times.copyWithin(0, droppedCount, this.count);
      this.values.copyWithin(0, droppedCount, this.count);
      this.count -= droppedCount;
      return;
    }
    for (const member of ["times", "values"]) {
      const larger = new Float64Array(Math.min(this.mostSamples, this.count * 2));
      larger.set(this[member]);
      this[member] = larger;
    }
  }

  /** The number, from 0, of the first sample after a time; `count` if there is none. */
  after(time) {
    return countWhile(this.times.subarray(0, this.count), (each) => each <= time);
  }

  /** The number of the last sample up to a time; -1 before the first sample. */
  at(time) {
    return this.after(time) - 1;
  }

  /** The text of a sample's value, "none" in a gap; "" for a number without a sample. */
  text(number) {
    if (number < 0 || number >= this.count) return "";
    const value = this.values[number];
    if (Number.isNaN(value)) return "none";
    return this.words ? this.words[value] : numberText(value);
  }

  /**
   * The least and the greatest value between two times. The samples before and after them count too, because
   * the line leads there. Null without values.
   */
  range(from, to) {
    let least = Infinity,
      greatest = -Infinity;
    const end = Math.min(this.count, this.after(to) + 1);
    for (let at = Math.max(0, this.at(from)); at < end; at++) {
      const value = this.values[at];
      if (value < least) least = value;
      if (value > greatest) greatest = value;
    }
    return least > greatest ? null : [least, greatest];
  }
}

/** The text of a number, rounded for human readers. */
export function numberText(value) {
  if (Number.isInteger(value) && Math.abs(value) < 1e9) return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e7)) return value.toExponential(3);
  return value.toFixed(size < 10 ? 4 : size < 1000 ? 3 : 1);
}

/**
 * Select points of a line of `columns` pixels: the first, least, greatest and last of each column, so that no
 * peak is lost; and one of the gaps in a column. With at most four samples a column on average, all are
 * selected.
 * @param from, to the numbers of the first sample and of the sample after the last
 * @param columnOf(time) the column of a time, with a fraction
 * @param select(number) gets the numbers of the selected samples in ascending order
 */
export function decimate({ times, values }, from, to, columns, columnOf, select) {
  if (to - from <= 4 * columns) {
    for (let at = from; at < to; at++) select(at);
    return;
  }
  let column = NaN,
    first = from,
    least = from,
    greatest = from,
    gap = -1;
  function flush(last) {
    const selected = [first, least, greatest, last, ...(gap < 0 ? [] : [gap])].sort((a, b) => a - b);
    selected.forEach((number, at) => {
      if (number !== selected[at - 1]) select(number);
    });
  }
  for (let at = from; at < to; at++) {
    const nextColumn = Math.floor(columnOf(times[at]));
    if (nextColumn !== column) {
      if (at > from) flush(at - 1);
      column = nextColumn;
      first = least = greatest = at;
      gap = -1;
    }
    const value = values[at];
    if (Number.isNaN(value)) gap = at;
    else {
      // negated, so that any value replaces NaN
      if (!(value >= values[least])) least = at;
      if (!(value <= values[greatest])) greatest = at;
    }
  }
  flush(to - 1);
}
