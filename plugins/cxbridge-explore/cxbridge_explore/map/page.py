"""The HTML page about an exploration: map of runs, effects of faults, unreached parts of the agent."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cxbridge.run.program.finished import write_document
from cxbridge_explore.map.coverage import as_dict
from cxbridge_explore.map.rows import run_rows
from cxbridge_explore.result import ExploreResult
from cxbridge_studio.explain.coverage.model import Coverage


def write_page(result: ExploreResult, coverage: Coverage, file: Path, command: str) -> None:
    """Write the page.

    :param command: the command that makes the page again.
    :raises CxbridgeError: if the file cannot be written, or no installed package makes pages.
    """
    write_document(file, "exploration", "Exploration", as_document(result, coverage, command))


def as_document(result: ExploreResult, coverage: Coverage, command: str) -> dict[str, Any]:
    """Return the values of the page as JSON values."""
    return {
        "command": command,
        "summary": _summary(result),
        "rows": [asdict(row) for row in run_rows(result.graph)],
        "properties": list(_properties(result)),
        "coverage": as_dict(coverage),
    }


def _summary(result: ExploreResult) -> str:
    graph = result.graph
    counts = ", ".join(f"{count} {outcome}" for outcome, count in result.outcomes.items())
    end = "complete" if result.is_complete else f"not complete: {len(graph.open)} branches are open"
    return f"{len(graph.leaves)} runs, {len(graph.nodes)} states, {graph.merged} merged; {end}. {counts}"


def _properties(result: ExploreResult) -> Iterator[dict[str, str]]:
    violated = {each["property"]: each for each in result.violations}
    for name in sorted({each.name for each in result.properties} | violated.keys()):
        found = violated.get(name)
        if found is not None:
            message = found.get("words") or found["message"]
            yield {"name": name, "verdict": "violated", "message": message}
        elif name in result.vacuous:
            yield {"name": name, "verdict": "vacuous", "message": "no run could have violated it"}
        else:
            yield {"name": name, "verdict": "holds", "message": ""}
