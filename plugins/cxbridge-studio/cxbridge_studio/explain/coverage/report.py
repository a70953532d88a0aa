"""Coverage as text, as JSON values, and in the format of lcov."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from cxbridge.printing import format_count, short_path
from cxbridge_studio.explain.coverage.model import Coverage, FileCoverage, NameCoverage


def format_report(coverage: Coverage, *, has_firings: bool) -> Iterator[str]:
    """Yield the text of the report.

    :param has_firings: whether any run has recorded firings.
    """
    runs_text = format_count(coverage.run_count, "run")
    if has_firings:
        counts_text = f"{coverage.fired_count} of {coverage.watched_count}"
        yield f"{counts_text} rules fired in {runs_text}: {coverage.percent:.1f} %"
        yield ""
        yield from _format_file_table(coverage)
        yield from _list_unfired_rules(coverage)
    else:
        yield f"which rules fired in {runs_text} was not recorded: record with --trace-level rules"
    yield ""
    yield from _format_names("goal classes", "appeared", coverage.goal_classes)
    yield from (f"  {name} was never {', '.join(modes)}" for name, modes in coverage.missing_modes)
    yield from _format_names("actions", "were executed", coverage.actions)
    yield from _format_names("skills", "were executed", coverage.skills)
    yield from (f"note: {note}" for note in coverage.notes)


def _format_file_table(coverage: Coverage) -> Iterator[str]:
    names = shorten_names(coverage.files)
    width = max(map(len, [*names, "file"]))
    yield f"{'file'.ljust(width)}  rules  fired      %"
    for name, file in zip(names, coverage.files, strict=True):
        percent = f"{100 * file.fired_count / file.watched_count:6.1f}" if file.watched_count else "     -"
        yield f"{name.ljust(width)}  {file.watched_count:5d}  {file.fired_count:5d} {percent}"


def shorten_names(files: Sequence[FileCoverage]) -> list[str]:
    """Return the names of the files, relative to the working directory if they are within it."""
    return [short_path(file.file) for file in files]


def _list_unfired_rules(coverage: Coverage) -> Iterator[str]:
    names = shorten_names(coverage.files)
    unfired_rules = [
        f"  {name}:{rule.lines[0]} {rule.name}"
        for name, file in zip(names, coverage.files, strict=True)
        for rule, count in file.rules
        if count == 0
    ]
    yield from ("", "never fired:", *unfired_rules) if unfired_rules else ()
    unwatched_rules = [rule.name for file in coverage.files for rule, count in file.rules if count is None]
    if unwatched_rules:
        yield f"firings not recorded: {', '.join(unwatched_rules)}"


def _format_names(title: str, verb: str, names: NameCoverage) -> Iterator[str]:
    yield f"{title}: {len(names.used)} of {len(names.used) + len(names.unused)} {verb}"
    if names.unused:
        yield f"  never: {', '.join(names.unused)}"


def to_json(coverage: Coverage) -> dict[str, Any]:
    """Return the coverage as JSON values."""
    return {
        "runs": coverage.run_count,
        "rules": {
            "total": coverage.watched_count,
            "fired": coverage.fired_count,
            "percent": round(coverage.percent, 2),
            "files": [_file_to_json(file) for file in coverage.files],
        },
        "goal_classes": {
            **_names_to_json(coverage.goal_classes),
            "missing_modes": {name: list(modes) for name, modes in coverage.missing_modes},
            "outcomes": {name: dict(counts) for name, counts in coverage.outcomes},
        },
        "actions": _names_to_json(coverage.actions),
        "skills": _names_to_json(coverage.skills),
        "notes": list(coverage.notes),
    }


def _file_to_json(file: FileCoverage) -> dict[str, Any]:
    return {
        "file": file.file,
        "total": file.watched_count,
        "fired": file.fired_count,
        "rules": [{"name": rule.name, "line": rule.lines[0], "firings": count} for rule, count in file.rules],
    }


def _names_to_json(names: NameCoverage) -> dict[str, Any]:
    return {"used": dict(names.used), "never": list(names.unused)}


def format_lcov_lines(coverage: Coverage) -> Iterator[str]:
    """Yield the lines of an lcov tracefile.

    A rule is a function in the tracefile, and a firing executes all lines of the rule.
    """
    for file in coverage.files:
        rules = [(rule, count) for rule, count in file.rules if count is not None]
        yield "TN:"
        yield f"SF:{file.file}"
        yield from (f"FN:{rule.lines[0]},{rule.name}" for rule, _ in rules)
        yield from (f"FNDA:{count},{rule.name}" for rule, count in rules)
        yield f"FNF:{len(rules)}"
        yield f"FNH:{sum(count > 0 for _, count in rules)}"
        # A tracefile has each line once, and rules can share a line.
        hits: dict[int, int] = {}
        for rule, count in rules:
            for line in rule.lines:
                hits[line] = max(hits.get(line, 0), count)
        yield from (f"DA:{line},{count}" for line, count in sorted(hits.items()))
        yield f"LF:{len(hits)}"
        yield f"LH:{sum(count > 0 for count in hits.values())}"
        yield "end_of_record"
