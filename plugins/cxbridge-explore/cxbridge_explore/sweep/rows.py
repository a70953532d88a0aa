"""The task of a sweep, and the result of each run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from pathlib import Path

    from cxbridge.run.options import RunOptions

CRASHED: Final = "crashed"
"""The outcome of a run whose process died."""


@dataclass(frozen=True, slots=True)
class SweepJob:
    """What all runs of a sweep have in common.

    :param options: as for ``cxbridge run``.
    :param world: the file of the world; None: the one in the scenario's folder, or the usual world.
    :param cpu_seconds: of processor time that a run may take before it counts as crashed.
    """

    options: RunOptions
    world: Path | None = None
    cpu_seconds: int = 120


_ENDS: Final = frozenset({"completed", "unsuccessful"})


@dataclass(frozen=True, slots=True)
class RunRow:
    """The result of a run.

    :param seed: of its world.
    :param outcome: in a word, as ``cxbridge run`` says it; :data:`CRASHED` when its process died.
    :param reason: in a sentence.
    :param makespan: seconds of the run's clock.
    :param calls: calls of skills.
    :param retries: those of them that were made before in the same words.
    :param faults: choices that were not the usual ones and count as a fault.
    :param goals: how many goals of each class ended with each outcome.
    :param choices: those that were not the usual ones, as a path can have them.
    :param cpu_seconds: of processor time.
    """

    seed: int
    outcome: str
    reason: str = ""
    makespan: float = 0.0
    calls: int = 0
    retries: int = 0
    faults: int = 0
    goals: dict[str, dict[str, int]] = field(default_factory=dict)
    choices: list[dict[str, Any]] = field(default_factory=list)
    cpu_seconds: float = 0.0

    @property
    def is_completed(self) -> bool:
        """Whether every root goal was completed."""
        return self.outcome == "completed"

    @property
    def came_to_its_end(self) -> bool:
        """Whether the run ended by itself, well or not."""
        return self.outcome in _ENDS


def outcomes_of(rows: Iterable[RunRow]) -> dict[str, int]:
    """Return how many runs had each outcome, the most frequent first."""
    return dict(Counter(row.outcome for row in rows).most_common())
