"""The answer to a question about a run, as text and as JSON values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Explanation:
    """A report about a rule, a goal, a plan-action, a fact or the whole run.

    :param lines: the report as text.
    :param json_report: the report as JSON values.
    """

    lines: tuple[str, ...]
    json_report: dict[str, Any]
