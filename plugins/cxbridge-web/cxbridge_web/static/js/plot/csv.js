// The samples of several series as one table: a row for each time at which one of them has a sample.

const quoted = (text) => (/[",\r\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text);

/** @returns the table from one time to another, as text; what has no sample at a time is empty there */
export function csv(series, from, to) {
  const rows = new Map(); // time -> cells
  for (const [column, each] of series.entries())
    for (let at = Math.max(0, each.at(from)); at < each.after(to); at++) {
      const time = each.times[at],
        value = each.values[at];
      if (!rows.has(time)) rows.set(time, Array(series.length).fill(""));
      rows.get(time)[column] = Number.isNaN(value) ? "" : quoted(each.words?.[value] ?? String(value));
    }
  const lines = [...rows].sort(([a], [b]) => a - b).map(([time, cells]) => [time, ...cells]);
  return [["time_us", ...series.map(({ name }) => quoted(name))], ...lines]
    .map((cells) => cells.join(",") + "\r\n")
    .join("");
}
