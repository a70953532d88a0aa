// Coverage: rules with their source, goals, actions, skills.
import { el, none } from "cx/dom.js";
import { modes, notes, outcomes, section, table } from "cx/documents/parts.js";

const meter = (part, whole) =>
  el.meter({ max: Math.max(whole, 1), value: whole ? part : 1, "aria-hidden": "true" });

/** A link to an element of the page: the address names a view, so the browser is not asked. */
const jump = (id, text) =>
  el.a(
    {
      href: "#",
      on: {
        click: (event) => {
          event.preventDefault();
          const target = document.getElementById(id);
          target.closest("details").open = true;
          target.scrollIntoView({ block: "center" });
        },
      },
    },
    text,
  );

function files(list) {
  const rows = list.map(({ name, total, fired, rules }, number) => {
    const never = rules.filter(({ firings }) => firings === 0);
    return [
      jump("f" + number, name),
      total,
      fired,
      total ? [((100 * fired) / total).toFixed(1) + " ", meter(fired, total)] : "-",
      never.length
        ? never.map((rule, at) => [at ? ", " : null, jump("f" + number + "-" + rule.lines[0], rule.name)])
        : "-",
    ];
  });
  return table(["file", "rules", "fired", "%", "never fired"], rows, {
    numbers: [1, 2, 3],
    empty: "no rules",
  });
}

function goals({ used, never, missing_modes: missing, outcomes: ended }, every) {
  const rows = Object.entries(used).map(([name, count]) => {
    const lacking = missing[name] || [],
      ends = Object.entries(ended[name] || {}).map(([end, times]) => [outcomes([end]), times + " "]);
    return [
      name,
      count,
      modes(every.filter((mode) => !lacking.includes(mode))),
      lacking.join(", ") || "-",
      ends.length ? ends : "-",
    ];
  });
  rows.push(...never.map((name) => [name, 0, "-", "all", "-"]));
  return table(["class", "goals", "modes reached", "never", "outcomes"], rows, {
    numbers: [1],
    empty: "no goals",
  });
}

function part(kind, { used, never }) {
  const rows = [...Object.entries(used), ...never.map((name) => [name, el("b.never", "0")])];
  return table([kind, "executed"], rows, { numbers: [1], empty: "no " + kind + "s" });
}

function* lines(number, { rules, text }) {
  const byLine = new Map(rules.flatMap((rule) => rule.lines.map((line) => [line, rule])));
  for (const [at, code] of text.replace(/\n+$/, "").split("\n").entries()) {
    const line = at + 1,
      rule = byLine.get(line),
      isFirst = rule && rule.lines[0] === line,
      kind = rule && (rule.firings === null ? "unknown" : rule.firings ? "hit" : "miss");
    yield el.tr(
      { class: kind, id: isFirst ? "f" + number + "-" + line : null },
      el("td.n", String(line)),
      el("td.n", isFirst ? (rule.firings === null ? "not watched" : rule.firings + "×") : ""),
      el.td(el.code(code)),
    );
  }
}

/** A file, line by line; it is open when one of its rules has never fired. */
const source = (file, number) =>
  el.details(
    { id: "f" + number, open: file.fired < file.total },
    el.summary(el.b(file.name), " " + file.fired + " of " + file.total + " rules fired"),
    el("div.wide", el("table.source", el.tbody([...lines(number, file)]))),
  );

/** Show the coverage of an agent. */
export function open(main, report) {
  const { rules, firings_known: isKnown } = report,
    runs = report.runs === 1 ? "1 run" : report.runs + " runs",
    verdict =
      rules.fired +
      " of " +
      rules.total +
      " rules fired in " +
      runs +
      ": " +
      rules.percent.toFixed(1) +
      " % ";
  const unknown = isKnown ? [] : ["which rules fired was not recorded: record with --trace-level rules"];
  main.append(
    el(
      "div.document.coverage",
      el("p.verdict", isKnown ? [verdict, meter(rules.fired, rules.total)] : runs),
      notes([...unknown, ...report.notes]),
      isKnown ? section("files", "Files", files(rules.files)) : null,
      section("goals", "Goals", goals(report.goal_classes, report.modes)),
      section("actions", "Actions and skills", part("action", report.actions), part("skill", report.skills)),
      isKnown
        ? section("source", "Source", rules.files.length ? rules.files.map(source) : none("no files"))
        : null,
    ),
  );
}
