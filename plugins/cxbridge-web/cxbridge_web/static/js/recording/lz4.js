// Unpacks LZ4 frames (github.com/lz4/lz4: lz4_Frame_format.md). Checksums are skipped: what is inside is
// checked as it is read.
const MAGIC = 0x184d2204;

/** @param size bytes that there are when it is unpacked. @throws RangeError when the data are damaged */
export function unLz4(from, size) {
  const view = new DataView(from.buffer, from.byteOffset, from.byteLength),
    out = new Uint8Array(size);
  if (view.getUint32(0, true) !== MAGIC) throw new RangeError("this is not an LZ4 frame");
  const flags = from[4],
    hasBlockSum = Boolean(flags & 16);
  let at = 7 + (flags & 8 ? 8 : 0) + (flags & 1 ? 4 : 0),
    end = 0;
  for (;;) {
    const header = view.getUint32(at, true),
      length = header & 0x7fffffff;
    at += 4;
    if (header === 0) return out.subarray(0, end);
    if (at + length > from.length) throw new RangeError("an LZ4 block is cut off");
    const block = from.subarray(at, at + length);
    if (header >>> 31) {
      put(out, block, end);
      end += length;
    } else end = unpackBlock(block, out, end);
    at += length + (hasBlockSum ? 4 : 0);
  }
}

function put(out, bytes, end) {
  if (end + bytes.length > out.length) throw new RangeError("more data than announced");
  out.set(bytes, end);
}

function unpackBlock(from, out, end) {
  let at = 0;
  function longer(length) {
    let more = 255;
    while (more === 255) {
      more = from[at++];
      length += more;
    }
    return length;
  }
  while (at < from.length) {
    const token = from[at++],
      literals = token >> 4 === 15 ? longer(15) : token >> 4;
    put(out, from.subarray(at, at + literals), end);
    at += literals;
    end += literals;
    if (at >= from.length) break; // the last sequence has literals only
    const offset = from[at] | (from[at + 1] << 8);
    at += 2;
    const length = ((token & 15) === 15 ? longer(15) : token & 15) + 4;
    if (!offset || offset > end || !(end + length <= out.length))
      throw new RangeError("an LZ4 block is damaged");
    for (const stop = end + length; end < stop; end++) out[end] = out[end - offset];
  }
  return end;
}
