"""Writes the rows of a sweep as CSV, or as Parquet if pyarrow is installed."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.extras import install_command
from cxbridge.file_access import replacing
from cxbridge_explore.sweep.rows import RunRow

# The columns; `goals` and `choices` contain JSON.
COLUMNS: Final = (
    "agent",
    "seed",
    "outcome",
    "reason",
    "makespan",
    "calls",
    "retries",
    "faults",
    "goals",
    "choices",
    "cpu_seconds",
)


def write_csv(tables: dict[str, Sequence[RunRow]], file: Path) -> None:
    """Write the rows as CSV, by agent and seed.

    :param tables: rows by agent.
    """
    with replacing(file) as fresh, fresh.open("w", encoding="utf-8", newline="") as output:
        writer = csv.DictWriter(output, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for agent, rows in tables.items():
            writer.writerows(_plain(agent, row) for row in rows)


def write_parquet(tables: dict[str, Sequence[RunRow]], file: Path) -> None:
    """Write the rows as Parquet, like :func:`write_csv`.

    :raises CxbridgeError: if pyarrow is not installed, or the file cannot be written.
    """
    try:
        import pyarrow as pa  # noqa: PLC0415 - an extra
        from pyarrow import parquet  # noqa: PLC0415 - an extra
    except ModuleNotFoundError:
        raise CxbridgeError(
            "Parquet needs the package 'pyarrow'",
            hint=f"{install_command('parquet', 'cxbridge-explore')}, or use --csv",
        ) from None
    rows = [_plain(agent, row) for agent, agent_rows in tables.items() for row in agent_rows]
    with replacing(file) as fresh:
        parquet.write_table(pa.Table.from_pylist(rows), fresh)


def _plain(agent: str, row: RunRow) -> dict[str, Any]:
    return {
        "agent": agent,
        "seed": row.seed,
        "outcome": row.outcome,
        "reason": row.reason,
        "makespan": row.makespan,
        "calls": row.calls,
        "retries": row.retries,
        "faults": row.faults,
        "goals": json.dumps(row.goals, ensure_ascii=False),
        "choices": json.dumps(row.choices, ensure_ascii=False),
        "cpu_seconds": row.cpu_seconds,
    }
