"""Coverage as text, as JSON values, as an HTML page, and in the format of lcov."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from cxbridge.printing import short_path
from cxbridge.run.pages import write_document
from cxbridge_studio.explain.coverage.model import MODES, Coverage, FileCoverage, UsedNames

_SHORT_FOLDER: Final = 12  # a common folder of at most this length stays in the file names


def lines(coverage: Coverage, *, firings_known: bool) -> Iterator[str]:
    """Yield the text of the report.

    :param firings_known: whether any run has recorded firings.
    """
    runs = "1 run" if coverage.runs == 1 else f"{coverage.runs} runs"
    if firings_known:
        yield f"{coverage.fired} of {coverage.counted} rules fired in {runs}: {coverage.percent:.1f} %"
        yield ""
        yield from _file_table(coverage)
        yield from _unfired_lines(coverage)
    else:
        yield f"which rules fired in {runs} was not recorded: record with --trace-level rules"
    yield ""
    yield from _name_lines("goal classes", "appeared", coverage.classes)
    yield from (f"  {name} was never {', '.join(missing)}" for name, missing in coverage.missing_modes)
    yield from _name_lines("actions", "were executed", coverage.actions)
    yield from _name_lines("skills", "were executed", coverage.skills)
    yield from (f"note: {note}" for note in coverage.notes)


def _file_table(coverage: Coverage) -> Iterator[str]:
    base, names = _split_folder(coverage.files)
    title = f"below {base}" if base else "file"
    width = max(map(len, [*names, title]))
    yield f"{title.ljust(width)}  rules  fired      %"
    for name, file in zip(names, coverage.files, strict=True):
        percent = f"{100 * file.fired / file.counted:6.1f}" if file.counted else "     -"
        yield f"{name.ljust(width)}  {file.counted:5d}  {file.fired:5d} {percent}"


def _split_folder(files: Sequence[FileCoverage]) -> tuple[str, list[str]]:
    """Return the common folder of the files, empty if it is short, and the file names relative to it."""
    names = [short_path(file.file) for file in files]
    base = os.path.commonpath([str(Path(name).parent) for name in names]) if len(names) > 1 else ""
    if len(base) <= _SHORT_FOLDER:
        return "", names
    return base, [str(Path(name).relative_to(base)) for name in names]


def short_names(files: Sequence[FileCoverage]) -> list[str]:
    """Return the file names, relative to the common folder if that is long."""
    return _split_folder(files)[1]


def _unfired_lines(coverage: Coverage) -> Iterator[str]:
    _, names = _split_folder(coverage.files)
    unfired = [
        f"  {name}:{rule.lines[0]} {rule.name}"
        for name, file in zip(names, coverage.files, strict=True)
        for rule, count in file.rules
        if count == 0
    ]
    if unfired:
        yield ""
        yield "never fired:"
        yield from unfired
    unwatched = [rule.name for file in coverage.files for rule, count in file.rules if count is None]
    if unwatched:
        yield f"firings not recorded: {', '.join(unwatched)}"


def _name_lines(title: str, verb: str, names: UsedNames) -> Iterator[str]:
    total = len(names.used) + len(names.unused)
    yield f"{title}: {len(names.used)} of {total} {verb}"
    if names.unused:
        yield f"  never: {', '.join(names.unused)}"


def plain(coverage: Coverage) -> dict[str, Any]:
    return {
        "runs": coverage.runs,
        "rules": {
            "total": coverage.counted,
            "fired": coverage.fired,
            "percent": round(coverage.percent, 2),
            "files": [_plain_file(file) for file in coverage.files],
        },
        "goal_classes": {
            **_plain_names(coverage.classes),
            "missing_modes": {name: list(modes) for name, modes in coverage.missing_modes},
            "outcomes": {name: dict(counts) for name, counts in coverage.outcomes},
        },
        "actions": _plain_names(coverage.actions),
        "skills": _plain_names(coverage.skills),
        "notes": list(coverage.notes),
    }


def _plain_file(file: FileCoverage) -> dict[str, Any]:
    return {
        "file": file.file,
        "total": file.counted,
        "fired": file.fired,
        "rules": [{"name": rule.name, "line": rule.lines[0], "firings": count} for rule, count in file.rules],
    }


def _plain_names(names: UsedNames) -> dict[str, Any]:
    return {"used": dict(names.used), "never": list(names.unused)}


def lcov(coverage: Coverage) -> Iterator[str]:
    """Yield the lines of an lcov tracefile: a rule is a function, its lines are executed when it fires."""
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


def write_page(path: Path, coverage: Coverage, texts: Mapping[str, str], *, firings_known: bool) -> None:
    """Write the page.

    :param texts: source texts by file name.
    :param firings_known: whether any run has recorded firings.
    :raises CxbridgeError: if the file cannot be written, or no installed package makes pages.
    """
    document = as_document(coverage, texts, firings_known=firings_known)
    write_document(path, "coverage", "Coverage", document)


def as_document(coverage: Coverage, texts: Mapping[str, str], *, firings_known: bool) -> dict[str, Any]:
    """Return the data of the page: the coverage as JSON values, with the source texts."""
    document = {**plain(coverage), "modes": list(MODES), "firings_known": firings_known}
    document["rules"]["files"] = [
        {
            "name": name,
            "total": file.counted,
            "fired": file.fired,
            "rules": [
                {"name": rule.name, "lines": rule.lines, "firings": count} for rule, count in file.rules
            ],
            # Without firings, the page has no lines to mark.
            "text": texts.get(file.file, "") if firings_known else "",
        }
        for name, file in zip(short_names(coverage.files), coverage.files, strict=True)
    ]
    return document
