// Long lists and tables. A line says how much is not shown at once.
cx.lists = (() => {
  const { el } = cx;
  const MOST = 1000;

  // only the rows that are seen exist; on paper the first MOST do
  function virtual(box, height, draw) {
    const room = el("div", { class: "room", role: "presentation" }), more = el("p", { class: "dim", hidden: true });
    box.append(room);
    box.after(more);
    let count = 0, printing = false, drawn = "";
    function update(force) {
      const high = height();
      const first = printing ? 0 : Math.max(0, Math.floor(box.scrollTop / high) - 8);
      const end = printing ? Math.min(count, MOST) : Math.min(count, Math.ceil((box.scrollTop + box.clientHeight) / high) + 8);
      if (!force && drawn === first + "-" + end) return;
      drawn = first + "-" + end;
      room.style.height = (printing ? end : count) * high + "px";
      const rows = [];
      for (let at = first; at < end; at++) {
        const row = draw(at);
        row.style.top = at * high + "px";
        row.style.height = high + "px";
        rows.push(row);
      }
      room.replaceChildren(...rows);
      more.hidden = !printing || count <= MOST;
      more.textContent = "The first " + MOST + " of " + count + " rows; the page has all of them on a screen.";
    }
    box.addEventListener("scroll", () => requestAnimationFrame(() => update(false)), { passive: true });
    new ResizeObserver(() => update(true)).observe(box);
    window.addEventListener("beforeprint", () => { printing = true; box.classList.add("printing"); update(true); });
    window.addEventListener("afterprint", () => { printing = false; box.classList.remove("printing"); update(true); });
    return {
      set(number) { count = number; update(true); },
      redraw: () => update(true),
      show(at) {
        const high = height(), top = at * high;
        if (top < box.scrollTop) box.scrollTop = top;
        else if (top + high > box.scrollTop + box.clientHeight) box.scrollTop = top + high - box.clientHeight;
        update(true);
      },
    };
  }

  // columns: [title, cell of a row, value to sort by, is a number]
  function table(place, caption, columns, rows, onRow) {
    let by = -1, down = false, wanted = "";
    const texts = rows.map((row) => columns.map((column) => String(column[2](row))).join("\n").toLowerCase());
    const find = el("input", { type: "search", "aria-label": "Filter: " + caption, placeholder: "filter", on: {
      input: () => { wanted = find.value.toLowerCase(); fill(); } } });
    const counter = el("span", { class: "dim", role: "status" });
    const body = el("tbody");
    const heads = columns.map(([title, , , number], at) => el("th", { scope: "col", class: number && "n" },
      el("button", { type: "button", class: "sort", on: { click: () => { down = by === at && !down; by = at; fill(); } } }, title)));
    function fill() {
      let found = rows.map((_, at) => at).filter((at) => !wanted || texts[at].includes(wanted));
      if (by >= 0) {
        const key = columns[by][2];
        found.sort((a, b) => (key(rows[a]) < key(rows[b]) ? -1 : key(rows[a]) > key(rows[b]) ? 1 : 0) * (down ? -1 : 1));
      }
      heads.forEach((head, at) => {
        if (at === by) head.setAttribute("aria-sort", down ? "descending" : "ascending"); else head.removeAttribute("aria-sort");
      });
      const shown = found.slice(0, MOST);
      counter.textContent = found.length > MOST ? MOST + " of " + found.length + " shown: filter to see others"
        : found.length + (found.length === rows.length ? "" : " of " + rows.length);
      body.replaceChildren(...shown.map((at) => el("tr", {}, columns.map(([title, cell, , number]) =>
        el("td", { class: number && "n", "data-title": title }, onRow && title === columns[0][0]
          ? el("button", { type: "button", class: "jump", on: { click: () => onRow(rows[at]) } }, cell(rows[at])) : cell(rows[at]))))));
    }
    if (!rows.length) { place.append(el("p", { class: "none" }, "none recorded")); return; }
    place.append(el("p", { class: "tools" }, find, " ", counter),
      el("div", { class: "wide long", tabindex: 0, role: "region", "aria-label": caption }, el("table", { "aria-label": caption }, el("thead", {}, el("tr", {}, heads)), body)));
    fill();
  }
  return { virtual, table };
})();
