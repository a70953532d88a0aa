// The samples of several series as one table: a row for each time at which one of them has a sample.

const quoted = (text) => (/[",\r\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text);

/** @returns the table from one time to another, as text; what has no sample at a time is empty there */
export function csv(series, from, to) {
  const rows = ["time_us," + series.map((each) => quoted(each.name)).join(",")];
  const at = series.map((each) => Math.max(0, each.at(from))),
    end = series.map((each) => each.after(to));
  for (;;) {
    let time = Infinity;
    series.forEach((each, column) => {
      if (at[column] < end[column]) time = Math.min(time, each.times[at[column]]);
    });
    if (time === Infinity) return rows.join("\r\n") + "\r\n";
    const cells = series.map((each, column) => {
      if (at[column] >= end[column] || each.times[at[column]] !== time) return "";
      const number = at[column]++,
        value = each.values[number];
      return Number.isNaN(value) ? "" : quoted(each.words ? each.words[value] : String(value));
    });
    rows.push(time + "," + cells.join(","));
  }
}
