// Tables of Finite State Entropy codes, as Zstandard writes them (RFC 8878, 4.1).
const top = (number) => 31 - Math.clz32(number);

/** @param shares how often each symbol is among 2^bits; -1: less than once */
export function makeFse(shares, bits) {
  const size = 1 << bits,
    symbols = new Uint8Array(size),
    lengths = new Uint8Array(size),
    bases = new Uint16Array(size),
    next = new Uint16Array(shares.length);
  let high = size,
    place = 0;
  shares.forEach((share, symbol) => {
    if (share === -1) {
      symbols[--high] = symbol;
      next[symbol] = 1;
    }
  });
  shares.forEach((share, symbol) => {
    if (share <= 0) return;
    next[symbol] = share;
    for (let count = 0; count < share; count++) {
      symbols[place] = symbol;
      do place = (place + (size >> 1) + (size >> 3) + 3) & (size - 1);
      while (place >= high);
    }
  });
  for (let state = 0; state < size; state++) {
    const number = next[symbols[state]]++;
    lengths[state] = bits - top(number);
    bases[state] = (number << lengths[state]) - size;
  }
  return { bits, symbols, lengths, bases };
}

export const oneSymbol = (symbol) => ({
  bits: 0,
  symbols: Uint8Array.of(symbol),
  lengths: Uint8Array.of(0),
  bases: Uint16Array.of(0),
});

/** @returns [table, where it ended] */
export function readFse(from, begin, mostBits) {
  let at = begin * 8;
  function read(count) {
    const byte = at >> 3,
      shift = at & 7;
    at += count;
    return ((from[byte] | (from[byte + 1] << 8) | (from[byte + 2] << 16)) >> shift) & ((1 << count) - 1);
  }
  const bits = read(4) + 5,
    shares = [];
  if (!(bits <= mostBits)) throw new RangeError("a table of symbols is damaged");
  for (let rest = 1 << bits; rest > 0;) {
    const width = top(rest + 1) + 1,
      few = (1 << width) - 2 - rest,
      half = (1 << (width - 1)) - 1;
    let value = read(width);
    if ((value & half) < few) {
      at -= 1;
      value &= half;
    } else if (value > half) value -= few;
    const share = value - 1;
    rest -= Math.abs(share);
    shares.push(share);
    if (share === 0)
      for (let more = 3; more === 3;) {
        more = read(2);
        for (let zero = 0; zero < more; zero++) shares.push(0);
      }
    if (rest < 0 || shares.length > 256 || at > from.length * 8)
      throw new RangeError("a table of symbols is damaged");
  }
  return [makeFse(shares, bits), (at + 7) >> 3];
}
