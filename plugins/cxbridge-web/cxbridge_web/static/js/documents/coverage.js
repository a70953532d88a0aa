// Coverage: rules with their source, goals, actions, skills.
import { el, none, plural } from "cx/dom.js";
import { modes, outcomes, show, table } from "cx/documents/parts.js";

const meter = (part, whole) =>
  el.meter({ max: Math.max(whole, 1), value: whole ? part : 1, "aria-hidden": "true" });

/** A link to an element of the page: the address names a view, so the browser is not asked. */
function jump(id, text) {
  const click = (event) => {
    event.preventDefault();
    const target = document.getElementById(id);
    target.closest("details").open = true;
    target.scrollIntoView({ block: "center" });
  };
  return el.a({ href: "#", on: { click } }, text);
}

function files(list) {
  const rows = list.map(({ name, total, fired, rules }, number) => {
    const never = rules.filter(({ firings }) => firings === 0),
      links = never.map((rule, at) => [
        at ? ", " : null,
        jump("f" + number + "-" + rule.lines[0], rule.name),
      ]),
      share = total ? [((100 * fired) / total).toFixed(1) + " ", meter(fired, total)] : "-";
    return [jump("f" + number, name), total, fired, share, links.length ? links : "-"];
  });
  const heads = ["file", "rules", "fired", "%", "never fired"];
  return table(heads, rows, { numbers: [1, 2, 3], empty: "no rules" });
}

function goals({ used, never, missing_modes: missing, outcomes: ended }, every) {
  const rows = Object.entries(used).map(([name, count]) => {
    const lacking = missing[name] || [],
      reached = every.filter((mode) => !lacking.includes(mode)),
      ends = Object.entries(ended[name] || {}).map(([end, times]) => [outcomes([end]), times + " "]);
    return [name, count, modes(reached), lacking.join(", ") || "-", ends.length ? ends : "-"];
  });
  const heads = ["class", "goals", "modes reached", "never", "outcomes"];
  return table(heads, [...rows, ...never.map((name) => [name, 0, "-", "all", "-"])], {
    numbers: [1],
    empty: "no goals",
  });
}

function part(kind, { used, never }) {
  const rows = [...Object.entries(used), ...never.map((name) => [name, el("b.never", "0")])];
  return table([kind, "executed"], rows, { numbers: [1], empty: "no " + kind + "s" });
}

function lines(number, { rules, text }) {
  const byLine = new Map(rules.flatMap((rule) => rule.lines.map((line) => [line, rule])));
  const line = (code, at) => {
    const rule = byLine.get(at + 1),
      isFirst = rule && rule.lines[0] === at + 1,
      kind = rule && (rule.firings === null ? "unknown" : rule.firings ? "hit" : "miss"),
      fired = isFirst ? (rule.firings === null ? "not watched" : rule.firings + "×") : "";
    return el.tr(
      { class: kind, id: isFirst ? "f" + number + "-" + (at + 1) : null },
      el("td.n", String(at + 1)),
      el("td.n", fired),
      el.td(el.code(code)),
    );
  };
  return text.replace(/\n+$/, "").split("\n").map(line);
}

/** A file, line by line; it is open when one of its rules has never fired. */
const source = (file, number) =>
  el.details(
    { id: "f" + number, open: file.fired < file.total },
    el.summary(el.b(file.name), " " + file.fired + " of " + file.total + " rules fired"),
    el("div.wide", el("table.source", el.tbody(lines(number, file)))),
  );

export function open(main, report) {
  const { rules, firings_known: isKnown, goal_classes: classes } = report,
    runs = plural(report.runs, "run"),
    share = `${rules.fired} of ${rules.total} rules fired in ${runs}: ${rules.percent.toFixed(1)} % `,
    unknown = isKnown ? [] : ["which rules fired was not recorded: record with --trace-level rules"];
  const head = {
    kind: "coverage",
    verdict: isKnown ? [share, meter(rules.fired, rules.total)] : runs,
    notes: [...unknown, ...report.notes],
  };
  show(main, head, [
    isKnown && ["files", "Files", files(rules.files)],
    ["goals", "Goals", goals(classes, report.modes)],
    ["actions", "Actions and skills", [part("action", report.actions), part("skill", report.skills)]],
    isKnown && ["source", "Source", rules.files.length ? rules.files.map(source) : none("no files")],
  ]);
}
