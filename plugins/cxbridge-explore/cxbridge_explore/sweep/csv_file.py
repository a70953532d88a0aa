"""Writes the rows of a sweep as CSV."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Final

from cxbridge.file_access import replaced_file
from cxbridge_explore.sweep.rows import RunRow

# The columns; `goals` and `choices` contain JSON.
COLUMNS: Final = ("agent", *(field.name for field in fields(RunRow)))


def write_csv(rows_by_agent: Mapping[str, Sequence[RunRow]], file: Path) -> None:
    """Write the rows as CSV, agent by agent, in the given order.

    :raises CxbridgeError: if the file cannot be written.
    """
    with replaced_file(file) as new_file, new_file.open("w", encoding="utf-8", newline="") as output:
        writer = csv.DictWriter(output, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for agent, rows in rows_by_agent.items():
            for row in rows:
                writer.writerow(
                    asdict(row)
                    | {
                        "agent": agent,
                        "goals": json.dumps(row.goals, ensure_ascii=False),
                        "choices": json.dumps(row.choices, ensure_ascii=False),
                    }
                )
