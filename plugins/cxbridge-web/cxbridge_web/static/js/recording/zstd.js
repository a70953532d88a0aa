// Unpacks Zstandard frames (RFC 8878). Without dictionaries; checksums are skipped: what is inside is
// checked as it is read.
import { BackBits, decodeSequences, SequenceTables } from "./zstd_sequences.js";
import { readFse } from "./zstd_fse.js";

const MAGIC = 0xfd2fb528,
  MOST_BITS = 11,
  MOST_BLOCK = 128 << 10;

/** @param size bytes that there are when it is unpacked. @throws RangeError when the data are damaged */
export function unZstd(from, size) {
  const view = new DataView(from.buffer, from.byteOffset, from.byteLength),
    out = { bytes: new Uint8Array(size), end: 0 };
  let at = 0;
  while (at < from.length) {
    const magic = view.getUint32(at, true);
    if ((magic & 0xfffffff0) === 0x184d2a50) at += 8 + view.getUint32(at + 4, true);
    else if (magic === MAGIC) at = unpackFrame(from, at + 4, out);
    else throw new RangeError("this is not a Zstandard frame");
  }
  return out.bytes.subarray(0, out.end);
}

function unpackFrame(from, at, out) {
  const flags = from[at++],
    isSingle = Boolean(flags & 32);
  if (!isSingle) at += 1; // the size of the window: everything is kept here
  const ids = [0, 1, 2, 4][flags & 3];
  if (from.subarray(at, at + ids).some(Boolean)) throw new RangeError("it was packed with a dictionary");
  at += ids + [isSingle ? 1 : 0, 2, 4, 8][flags >> 6];
  const state = { huffman: null, tables: new SequenceTables(), begin: out.end };
  for (let isLast = false; !isLast;) {
    const header = from[at] | (from[at + 1] << 8) | (from[at + 2] << 16),
      type = (header >> 1) & 3,
      length = header >> 3;
    isLast = Boolean(header & 1);
    at += 3;
    const stop = at + (type === 1 ? 1 : length);
    if (!(stop <= from.length)) throw new RangeError("a Zstandard block is cut off");
    if (type === 1) append(out, new Uint8Array(length).fill(from[at]));
    else if (type === 0) append(out, from.subarray(at, stop));
    else if (type === 2) unpackBlock(from.subarray(at, stop), out, state);
    else throw new RangeError("a Zstandard block is damaged");
    at = stop;
  }
  return at + (flags & 4 ? 4 : 0);
}

function append(out, bytes) {
  if (out.end + bytes.length > out.bytes.length) throw new RangeError("more data than announced");
  out.bytes.set(bytes, out.end);
  out.end += bytes.length;
}

function unpackBlock(from, out, state) {
  const { literals, at } = readLiterals(from, state);
  decodeSequences(from, at, literals, out, state);
}

/** What is copied as it is; it may be packed by Huffman codes. */
function readLiterals(from, state) {
  const type = from[0] & 3,
    format = (from[0] >> 2) & 3;
  if (type < 2) {
    const header = [1, 2, 1, 3][format],
      size =
        header === 1 ? from[0] >> 3 : (from[0] >> 4) | (from[1] << 4) | (header === 3 ? from[2] << 12 : 0);
    const at = header + (type === 1 ? 1 : size);
    if (size > MOST_BLOCK || at > from.length) throw new RangeError("literals are damaged");
    return { at, literals: type === 1 ? new Uint8Array(size).fill(from[header]) : from.subarray(header, at) };
  }
  const header = [3, 3, 4, 5][format],
    width = 2 ** [10, 10, 14, 18][format];
  let both = 0; // up to 40 bits: no integer operations
  for (let byte = header - 1; byte >= 0; byte--) both = both * 256 + from[byte];
  both = Math.floor(both / 16);
  const size = both % width,
    at = header + (Math.floor(both / width) % width);
  if (size > MOST_BLOCK || at > from.length) throw new RangeError("literals are damaged");
  let begin = header;
  if (type === 2) [state.huffman, begin] = readHuffman(from.subarray(0, at), header);
  if (!state.huffman) throw new RangeError("there is no Huffman table to repeat");
  const literals = new Uint8Array(size);
  if (format === 0) decodeHuffman(state.huffman, from.subarray(begin, at), literals);
  else {
    const part = (size + 3) >> 2;
    let stream = begin + 6;
    for (let number = 0; number < 4; number++) {
      const stop =
        number === 3 ? at : stream + (from[begin + 2 * number] | (from[begin + 2 * number + 1] << 8));
      if (stop > at) throw new RangeError("literals are damaged");
      decodeHuffman(
        state.huffman,
        from.subarray(stream, stop),
        literals.subarray(number * part, number === 3 ? size : (number + 1) * part),
      );
      stream = stop;
    }
  }
  return { at, literals };
}

/**
 * @returns [{bits, symbols, lengths}: by the next bits the symbol and how many bits it has, where it
 * ended]
 */
function readHuffman(from, at) {
  const head = from[at++];
  let weights = [];
  if (head >= 128) {
    const count = head - 127;
    for (let number = 0; number < count; number++)
      weights.push(number % 2 ? from[at + (number >> 1)] & 15 : from[at + (number >> 1)] >> 4);
    at += (count + 1) >> 1;
  } else {
    weights = readWeights(from.subarray(at, at + head));
    at += head;
  }
  const sum = weights.reduce((all, weight) => all + (weight ? 2 ** (weight - 1) : 0), 0),
    bits = Math.floor(Math.log2(sum)) + 1;
  const rest = Math.log2(2 ** bits - sum);
  if (!(sum > 0) || bits > MOST_BITS || !Number.isInteger(rest))
    throw new RangeError("a Huffman table is damaged");
  weights.push(rest + 1);
  const symbols = new Uint8Array(1 << bits),
    lengths = new Uint8Array(1 << bits);
  let place = 0;
  for (let weight = 1; weight <= bits; weight++) {
    weights.forEach((each, symbol) => {
      if (each !== weight) return;
      const next = place + (1 << (weight - 1));
      symbols.fill(symbol, place, next);
      lengths.fill(bits + 1 - weight, place, next);
      place = next;
    });
  }
  return [{ bits, symbols, lengths }, at];
}

/** Weights that two states of one table take turns to tell, until the bits are used up. */
function readWeights(from) {
  const [table, begin] = readFse(from, 0, 6),
    bits = new BackBits(from.subarray(begin)),
    weights = [];
  const states = [bits.read(table.bits), bits.read(table.bits)];
  for (let turn = 0; weights.length < 255; turn ^= 1) {
    const state = states[turn];
    weights.push(table.symbols[state]);
    states[turn] = table.bases[state] + bits.read(table.lengths[state]);
    if (bits.left < 0) {
      weights.push(table.symbols[states[turn ^ 1]]);
      return weights;
    }
  }
  throw new RangeError("a Huffman table is damaged");
}

function decodeHuffman({ bits, symbols, lengths }, from, out) {
  let left = new BackBits(from).left;
  const mask = (1 << bits) - 1;
  for (let number = 0; number < out.length; number++) {
    const low = left - bits,
      byte = low >> 3;
    const next =
      low >= 0
        ? (from[byte] | (from[byte + 1] << 8) | (from[byte + 2] << 16)) >> (low & 7)
        : (from[0] | (from[1] << 8)) << -low;
    out[number] = symbols[next & mask];
    left -= lengths[next & mask];
  }
  if (left !== 0) throw new RangeError("literals are damaged");
}
