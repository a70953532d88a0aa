"""Output of a comparison for programs, ``trace diff --json``; fields: docs/comparing.md."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Final

from cxbridge.trace.compare.model import Difference
from cxbridge.trace.compare.render.text import ComparisonReport, summary

MAX_DIFFERENCES: Final = 1000
"""The maximum number of differences in the output, chosen freely; ``total`` counts all."""

VERSION: Final = 3
"""The version of the format; increased when a field is removed or changes its meaning."""


def report_to_json(report: ComparisonReport, options: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the result as JSON values; numbers of events count from 1.

    :param options: the options of the comparison.
    """
    comparison = report.comparison
    return {
        "version": VERSION,
        "same": comparison.same,
        "summary": summary(comparison),
        "level": comparison.view.value,
        "order": comparison.order.value,
        "options": dict(options or {}),
        "a": {"path": str(report.a.path), "format": report.a.format, "events": comparison.count_a},
        "b": {
            "path": str(report.b.path),
            "format": report.b.format,
            "events": comparison.count_b,
            "number": comparison.other_index + 1,
        },
        "total": len(comparison.differences),
        "differences": [
            difference_to_json(difference) for difference in comparison.differences[:MAX_DIFFERENCES]
        ],
        "hints": list(comparison.hints),
        "notes": [f"{run.path}: {note}" for _, run, _ in report.sides for note in run.notes],
        "first": {"a": asdict(report.context_a), "b": asdict(report.context_b)}
        if comparison.differences
        else None,
    }


def difference_to_json(difference: Difference) -> dict[str, Any]:
    """Return a difference as JSON values."""
    return {
        "kind": difference.kind.value,
        "subject": difference.subject,
        "what": difference.what,
        "count": difference.count,
        **{
            name: {"event": side.number, "text": side.text}
            for name, side in (("a", difference.a), ("b", difference.b))
        },
    }
