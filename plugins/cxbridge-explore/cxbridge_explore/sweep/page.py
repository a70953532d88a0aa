"""The HTML page about a sweep: outcomes, durations, goals, and seeds to inspect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cxbridge.run.program.finished import write_document
from cxbridge_explore.sweep.rows import RunRow
from cxbridge_explore.sweep.summary import AgentComparison, SweepSummary


def write_page(sweeps: Mapping[str, Sequence[RunRow]], file: Path, command: str) -> None:
    """Write the page about one agent, or about two on the same seeds.

    :param sweeps: rows by agent.
    :param command: the command that makes the page again.
    :raises CxbridgeError: if the file cannot be written, or no installed package makes pages.
    """
    write_document(file, "sweep", f"Sweep of {' and '.join(sweeps)}", as_document(sweeps, command))


def as_document(sweeps: Mapping[str, Sequence[RunRow]], command: str) -> dict[str, Any]:
    by_seed = [{row.seed: row for row in rows} for rows in sweeps.values()]
    return {
        "command": command,
        "sweeps": {
            name: {
                **SweepSummary(rows).as_dict(),
                "seeds": {end: SweepSummary(rows).seeds_of(end) for end in SweepSummary(rows).outcomes},
                "makespans": [row.makespan for row in rows if row.is_completed],
            }
            for name, rows in sweeps.items()
        },
        "comparison": AgentComparison(*by_seed).as_dict() if len(by_seed) > 1 else None,
    }
