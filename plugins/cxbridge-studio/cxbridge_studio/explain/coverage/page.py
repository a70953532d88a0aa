"""Coverage as one page that works offline: rules with their source, goals, actions, skills."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from cxbridge.file_access import write_file
from cxbridge.history.outcome import goal_outcome
from cxbridge.trace.html.page import Page, Section, asset
from cxbridge.trace.html.parts import badge, goal_badge, notes, table
from cxbridge.trace.html.text import html
from cxbridge_studio.explain.coverage.model import MODES, Coverage, FileCoverage, UsedNames
from cxbridge_studio.explain.coverage.report import short_names

_FINISHED: Final = "FINISHED"


def write_page(path: Path, coverage: Coverage, texts: Mapping[str, str], *, firings_known: bool) -> None:
    """Write the page.

    :param texts: of the files, by the names that they have in the coverage.
    :param firings_known: whether any run has firings.
    :raises CxbridgeError: when the file cannot be written.
    """
    write_file(path, render(coverage, texts, firings_known=firings_known))


def render(coverage: Coverage, texts: Mapping[str, str], *, firings_known: bool) -> str:
    """Return the page; see :func:`write_page`."""
    runs = "1 run" if coverage.runs == 1 else f"{coverage.runs} runs"
    remarks = list(coverage.notes)
    lead = f'<p class="verdict">{coverage.fired} of {coverage.counted} rules fired in {runs}: '
    lead += f"{coverage.percent:.1f} % {_meter(coverage.fired, coverage.counted)}</p>"
    if not firings_known:
        lead = f"<p>{runs}</p>"
        remarks.insert(0, "which rules fired was not recorded: record with --trace-level rules")
    sections = [
        Section("goals", "Goals", _goals(coverage)),
        Section(
            "actions",
            "Actions and skills",
            _part("action", coverage.actions) + _part("skill", coverage.skills),
        ),
    ]
    if firings_known:
        names = short_names(coverage.files)
        sections.insert(0, Section("files", "Files", _files(coverage.files, names)))
        sources = "".join(
            _source(number, name, file, texts.get(file.file, ""))
            for number, (name, file) in enumerate(zip(names, coverage.files, strict=True))
        )
        sections.append(Section("source", "Source", sources))
    return Page(
        title="Coverage",
        lead=lead + notes(remarks),
        sections=sections,
        styles=(asset("coverage.css", "cxbridge_studio.explain.coverage"),),
    ).render()


def _meter(part: int, whole: int) -> str:
    """Return a bar; what it says stands next to it in numbers."""
    return f'<meter max="{max(whole, 1)}" value="{part if whole else 1}" aria-hidden="true"></meter>'


def _files(files: tuple[FileCoverage, ...], names: list[str]) -> str:
    rows = []
    for number, (name, file) in enumerate(zip(names, files, strict=True)):
        never = [rule for rule, count in file.rules if count == 0]
        links = ", ".join(f'<a href="#f{number}-{rule.lines[0]}">{html(rule.name)}</a>' for rule in never)
        percent = f"{100 * file.fired / file.counted:.1f}" if file.counted else "-"
        rows.append(
            [
                f'<a href="#f{number}">{html(name)}</a>',
                str(file.counted),
                str(file.fired),
                f"{percent} {_meter(file.fired, file.counted)}",
                links or '<span class="dim">-</span>',
            ]
        )
    return table(["file", "rules", "fired", "%", "never fired"], rows, numbers=(1, 2, 3))


def _goals(coverage: Coverage) -> str:
    missing, outcomes = dict(coverage.missing_modes), dict(coverage.outcomes)
    rows = []
    for name, count in coverage.classes.used:
        never = missing.get(name, ())
        reached = " ".join(badge(goal_outcome(mode, ""), mode) for mode in MODES if mode not in never)
        ends = " ".join(
            f"{goal_badge(_FINISHED, outcome)} {times}" for outcome, times in outcomes.get(name, ())
        )
        rows.append([html(name), str(count), reached, html(", ".join(never)) or "-", ends or "-"])
    rows += [[html(name), "0", "-", "all", "-"] for name in coverage.classes.unused]
    if not rows:
        return '<p class="none">no goals</p>'
    return table(["class", "goals", "modes reached", "never", "outcomes"], rows, numbers=(1,))


def _part(kind: str, part: UsedNames) -> str:
    rows = [[html(name), str(count)] for name, count in part.used]
    rows += [[html(name), '<b class="never">0</b>'] for name in part.unused]
    if not rows:
        return f'<p class="none">no {kind}s</p>'
    return table([kind, "executed"], rows, numbers=(1,))


def _source(number: int, name: str, file: FileCoverage, text: str) -> str:
    """Return a file, line by line; it is open when one of its rules has never fired."""
    opened = " open" if file.fired < file.counted else ""
    lines = "".join(_lines(number, file, text))
    return (
        f'<details id="f{number}"{opened}><summary><b>{html(name)}</b> '
        f"{file.fired} of {file.counted} rules fired</summary>"
        f'<div class="wide"><table class="source"><tbody>{lines}</tbody></table></div></details>'
    )


def _lines(number: int, file: FileCoverage, text: str) -> Iterator[str]:
    counts = {line: count for rule, count in file.rules for line in rule.lines}
    firsts = {rule.lines[0] for rule, _ in file.rules}
    for line, code in enumerate(text.rstrip("\n").split("\n"), 1):
        anchor = f' id="f{number}-{line}"' if line in firsts else ""
        kind, shown = "", ""
        if line in counts:
            count = counts[line]
            kind = "unknown" if count is None else "hit" if count else "miss"
            if line in firsts:
                shown = "not watched" if count is None else f"{count}\N{MULTIPLICATION SIGN}"
        mark = f' class="{kind}"' if kind else ""
        yield (
            f'<tr{anchor}{mark}><td class="n">{line}</td><td class="n">{shown}</td>'
            f"<td><code>{html(code)}</code></td></tr>"
        )
