"""A comparison as values for programs: ``trace diff --json``; docs/comparing.md lists the fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, Final

from cxbridge.trace.compare.report import Report
from cxbridge.trace.compare.result import Difference, Row, Side
from cxbridge.trace.compare.trail import Context, Line

VERSION: Final = 1
"""Version of the form; it grows when a field goes or changes its meaning, not when one is new."""


def plain_report(
    report: Report, options: Mapping[str, Any] | None = None, unused: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the outcome as values that JSON knows; numbers of events count from 1.

    :param options: how it was compared, told as it is.
    :param unused: entries of the baseline that no difference met.
    """
    comparison = report.comparison
    return {
        "version": VERSION,
        "same": comparison.same,
        "level": comparison.view.value,
        "order": comparison.order.value,
        "options": dict(options or {}),
        "a": {"path": str(report.a.path), "format": report.a.format, "events": comparison.count_a},
        "b": {
            "path": str(report.b.path),
            "format": report.b.format,
            "events": comparison.count_b,
            "number": comparison.other + 1,
        },
        "total": comparison.total,
        "differences": [plain_difference(difference) for difference in comparison.differences],
        "accepted": [
            {**plain_difference(each.difference), "reason": each.reason} for each in comparison.accepted
        ],
        "baseline_unused": list(unused),
        "hints": list(comparison.hints),
        "alike": comparison.alike,
        "first": _first(report) if comparison.differences else None,
    }


def plain_difference(difference: Difference) -> dict[str, Any]:
    """Return a difference as values that JSON knows."""
    return {
        "kind": difference.kind.value,
        "subject": difference.subject,
        "what": difference.what,
        "count": difference.count,
        "a": _side(difference.a),
        "b": _side(difference.b),
    }


def _first(report: Report) -> dict[str, Any]:
    """Return what led to the first difference."""
    return {
        "rows": [_row(row) for row in report.comparison.rows],
        "a": _context(report.context_a),
        "b": _context(report.context_b),
    }


def _side(side: Side) -> dict[str, Any]:
    return {"event": None if side.position is None else side.position + 1, "text": side.text}


def _row(row: Row) -> dict[str, Any]:
    return {"same": row.same, "a": _line(row.a), "b": _line(row.b)}


def _line(line: Line | None) -> dict[str, Any] | None:
    return None if line is None else asdict(line)


def _context(context: Context) -> dict[str, Any]:
    return {
        "lines": [asdict(line) for line in context.lines],
        "rules": list(context.rules),
        "goals": [asdict(goal) for goal in context.goals],
    }
