"""The job of a sweep, and the row with the result of a run."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from pathlib import Path

    from cxbridge.run.options import RunOptions

CRASHED: Final = "crashed"  # outcome of a run whose process died


@dataclass(frozen=True, slots=True)
class SweepJob:
    """The common part of all runs of a sweep.

    :param options: the options of ``cxbridge run``.
    :param world: the file of the world; None for the file in the scenario's folder, or the default world.
    :param cpu_limit_s: the processor time in seconds after which a run counts as crashed. Systems that cannot
        fork do not limit it. The default is chosen freely.
    """

    options: RunOptions
    world: Path | None = None
    cpu_limit_s: int = 120


@dataclass(frozen=True, slots=True)
class RunRow:
    """The result of a run.

    The names of the fields are the columns of CSV files.

    :param seed: the seed of the world.
    :param outcome: the word printed by ``cxbridge run``, or :data:`CRASHED`.
    :param reason: the reason, in a sentence.
    :param makespan: the duration of the run, in seconds of its clock.
    :param calls: the number of skill calls, without those of killed agents.
    :param faults: the number of unusual choices that count as a fault.
    :param goals: the number of goals by class and outcome.
    :param choices: the unusual choices as JSON values.
    :param cpu_seconds: the processor time of the run.
    """

    seed: int
    outcome: str
    reason: str = ""
    makespan: float = 0.0
    calls: int = 0
    faults: int = 0
    goals: dict[str, dict[str, int]] = field(default_factory=dict)
    choices: list[dict[str, Any]] = field(default_factory=list)
    cpu_seconds: float = 0.0

    @property
    def is_completed(self) -> bool:
        """Whether every root goal was completed."""
        return self.outcome == "completed"

    @property
    def has_ended(self) -> bool:
        """Whether the run ended by itself, successfully or not."""
        return self.outcome in ("completed", "unsuccessful")
