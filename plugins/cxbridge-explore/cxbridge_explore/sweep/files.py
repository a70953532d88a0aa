"""Writes the rows of a sweep as CSV or Parquet."""

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
from cxbridge_explore.sweep.rows import RunRow

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
