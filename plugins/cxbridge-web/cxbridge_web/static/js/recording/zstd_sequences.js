// The sequences of a Zstandard block: copy so many literals, then repeat what was so far back (RFC 8878,
// 3.1.1.3.2).
import { makeFse, oneSymbol, readFse } from "./zstd_fse.js";

const steps = (plain, first, widths) => {
  const bases = Array.from({ length: plain }, (_, code) => code + first),
    bits = bases.map(() => 0);
  let base = plain + first;
  for (const width of widths) {
    bases.push(base);
    bits.push(width);
    base += 2 ** width;
  }
  return { bases, bits };
};
const LITERALS = steps(16, 0, [1, 1, 1, 1, 2, 2, 3, 3, 4, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]);
const MATCHES = steps(32, 3, [1, 1, 1, 1, 2, 2, 3, 3, 4, 4, 5, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]);
const ones = (count) => Array(count).fill(1),
  twos = (count) => Array(count).fill(2),
  rare = (count) => Array(count).fill(-1);
const USUAL = {
  literals: makeFse([4, 3, ...twos(11), ...ones(3), ...twos(9), 3, 2, ...ones(5), ...rare(4)], 6),
  offsets: makeFse([...ones(6), ...twos(3), ...ones(15), ...rare(5)], 5),
  matches: makeFse([1, 4, 3, ...twos(6), ...ones(37), ...rare(7)], 6),
};
const MOST_BITS = { literals: 9, offsets: 8, matches: 9 };

/** Bits that are read from the end of the bytes; the highest one that is set marks where they begin. */
export class BackBits {
  constructor(bytes) {
    this.bytes = bytes;
    const last = bytes[bytes.length - 1];
    if (!last) throw new RangeError("a stream of bits is damaged");
    this.left = bytes.length * 8 - 8 + 31 - Math.clz32(last);
  }

  /** Before the begin are zeros; `left` is below 0 then. */
  read(count) {
    if (count > 16) return this.read(count - 16) * 65536 + this.read(16);
    this.left -= count;
    const low = Math.max(this.left, 0),
      byte = low >> 3,
      { bytes } = this,
      mask = (1 << count) - 1;
    const value = (bytes[byte] | (bytes[byte + 1] << 8) | (bytes[byte + 2] << 16)) >>> (low & 7);
    return this.left >= 0 ? value & mask : this.left <= -count ? 0 : (value << -this.left) & mask;
  }
}

/** What blocks of a frame hand on: tables, and the last three distances. */
export class SequenceTables {
  constructor() {
    this.known = {};
    this.back = [1, 4, 8];
  }

  read(name, mode, from, at) {
    if (mode === 0) this.known[name] = USUAL[name];
    else if (mode === 1) this.known[name] = oneSymbol(from[at++]);
    else if (mode === 2) [this.known[name], at] = readFse(from, at, MOST_BITS[name]);
    else if (!this.known[name]) throw new RangeError("there is no table to repeat");
    return at;
  }

  /** How far back a match begins. */
  distance(value, noLiterals) {
    const { back } = this,
      which = value - 1 + (noLiterals ? 1 : 0);
    if (value > 3) this.back = [value - 3, back[0], back[1]];
    else if (which === 1) this.back = [back[1], back[0], back[2]];
    else if (which === 2) this.back = [back[2], back[0], back[1]];
    else if (which === 3) this.back = [back[0] - 1, back[0], back[1]];
    return this.back[0];
  }
}

export function decodeSequences(from, at, literals, out, { tables, begin }) {
  const { bytes } = out;
  let used = 0;
  function copy(count) {
    if (used + count > literals.length || out.end + count > bytes.length)
      throw new RangeError("a Zstandard block is damaged");
    bytes.set(literals.subarray(used, used + count), out.end);
    used += count;
    out.end += count;
  }
  let count = from[at++];
  if (count === 255) {
    count = (from[at] | (from[at + 1] << 8)) + 0x7f00;
    at += 2;
  } else if (count > 127) count = ((count - 128) << 8) | from[at++];
  if (count) {
    const modes = from[at++];
    at = tables.read("literals", modes >> 6, from, at);
    at = tables.read("offsets", (modes >> 4) & 3, from, at);
    at = tables.read("matches", (modes >> 2) & 3, from, at);
    const { literals: ll, offsets: of, matches: ml } = tables.known,
      bits = new BackBits(from.subarray(at));
    let ofLiterals = bits.read(ll.bits),
      ofOffsets = bits.read(of.bits),
      ofMatches = bits.read(ml.bits);
    while (count--) {
      const llCode = ll.symbols[ofLiterals],
        ofCode = of.symbols[ofOffsets],
        mlCode = ml.symbols[ofMatches];
      const value = 2 ** ofCode + bits.read(ofCode);
      const length = MATCHES.bases[mlCode] + bits.read(MATCHES.bits[mlCode]),
        ahead = LITERALS.bases[llCode] + bits.read(LITERALS.bits[llCode]);
      const distance = tables.distance(value, ahead === 0);
      copy(ahead);
      if (!(distance > 0) || distance > out.end - begin || !(out.end + length <= bytes.length))
        throw new RangeError("a Zstandard block is damaged");
      for (let end = out.end + length, to = out.end; to < end; to++) bytes[to] = bytes[to - distance];
      out.end += length;
      if (count) {
        ofLiterals = ll.bases[ofLiterals] + bits.read(ll.lengths[ofLiterals]);
        ofMatches = ml.bases[ofMatches] + bits.read(ml.lengths[ofMatches]);
        ofOffsets = of.bases[ofOffsets] + bits.read(of.lengths[ofOffsets]);
      }
    }
    if (bits.left !== 0) throw new RangeError("a Zstandard block is damaged");
  }
  copy(literals.length - used);
}
