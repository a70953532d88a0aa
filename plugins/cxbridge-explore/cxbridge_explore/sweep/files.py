"""Writes the result of a sweep: rows as CSV or Parquet, and an HTML page."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.extras import install_command
from cxbridge.file_access import replaced_file
from cxbridge.run.pages import write_document
from cxbridge_explore.sweep.rows import RunRow
from cxbridge_explore.sweep.summary import AgentComparison, SweepSummary

# The columns; `goals` and `choices` contain JSON.
COLUMNS: Final = ("agent", *(field.name for field in fields(RunRow)))

Sweeps = Mapping[str, Sequence[RunRow]]  # rows by agent, in the order of seeds


def write_csv(sweeps: Sweeps, file: Path) -> None:
    """Write the rows as CSV, by agent and seed.

    :raises CxbridgeError: if the file cannot be written.
    """
    with replaced_file(file) as new_file, new_file.open("w", encoding="utf-8", newline="") as output:
        writer = csv.DictWriter(output, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(_make_records(sweeps))


def write_parquet(sweeps: Sweeps, file: Path) -> None:
    """Write the rows as Parquet, with the columns of :func:`write_csv`.

    :raises CxbridgeError: if pyarrow is not installed, or the file cannot be written.
    """
    try:
        import pyarrow as pa  # noqa: PLC0415 - pyarrow may be missing
        from pyarrow import parquet  # noqa: PLC0415 - pyarrow may be missing
    except ModuleNotFoundError:
        raise CxbridgeError(
            "Parquet needs the package 'pyarrow'",
            hint=f"{install_command('parquet', 'cxbridge-explore')}, or use --csv",
        ) from None
    with replaced_file(file) as new_file:
        parquet.write_table(pa.Table.from_pylist(_make_records(sweeps)), new_file)


def _make_records(sweeps: Sweeps) -> list[dict[str, Any]]:
    """Return each row as values by column."""
    return [
        {
            "agent": agent,
            **asdict(row),
            "goals": json.dumps(row.goals, ensure_ascii=False),
            "choices": json.dumps(row.choices, ensure_ascii=False),
        }
        for agent, rows in sweeps.items()
        for row in rows
    ]


def write_page(sweeps: Sweeps, file: Path, command: str) -> None:
    """Write the page about one agent, or about two agents with the same seeds.

    :param command: the command that reproduces the page, to show on the page.
    :raises CxbridgeError: if the file cannot be written, or no installed package makes pages.
    """
    rows_by_seed = [{row.seed: row for row in rows} for rows in sweeps.values()]
    document = {
        "command": command,
        "sweeps": {agent: _page_summary(rows) for agent, rows in sweeps.items()},
        "comparison": AgentComparison(*rows_by_seed).as_dict() if len(rows_by_seed) > 1 else None,
    }
    write_document(file, "sweep", f"Sweep of {' and '.join(sweeps)}", document)


def _page_summary(rows: Sequence[RunRow]) -> dict[str, Any]:
    summary = SweepSummary(rows)
    return {
        **summary.as_dict(),
        # The page lists seeds of each outcome, even those of completed runs.
        "seeds": {outcome: summary.find_seeds(outcome) for outcome in summary.outcomes},
        "makespans": [row.makespan for row in rows if row.is_completed],
    }
