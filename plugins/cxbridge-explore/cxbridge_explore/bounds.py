"""The bounds of an exploration, and the options of its execution."""

from __future__ import annotations

import os
from dataclasses import dataclass

from cxbridge.errors import CxbridgeError
from cxbridge_explore.forking import HAS_FORK

PATIENCE_S = 60.0  # default limit of a run's processor time between two choices, in seconds


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """The bounds of an exploration. The result is complete within them.

    :param faults: the maximum number of faults in a run.
    :param depth: the number of first choice points with unusual options; None for all.
    :param merge: whether to visit equal states once.
    """

    faults: int = 1
    depth: int | None = None
    merge: bool = True

    def check(self) -> None:
        """Raise `CxbridgeError` if a bound is invalid."""
        for name, value in (("faults", self.faults), ("depth", self.depth or 0)):
            if value < 0:
                raise CxbridgeError(f"--{name} cannot be {value}", hint="use 0 or more")


@dataclass(frozen=True, kw_only=True)
class ExecutionOptions:
    """Options without influence on the result.

    :param jobs: the number of parallel runs; None for the number of cores.
    :param fork: whether to fork runs; otherwise each run starts from the beginning.
    :param patience_s: the limit of a run's processor time between two choices.
    :param coverage: whether to record the used parts of the agent.
    """

    jobs: int | None = None
    fork: bool = HAS_FORK
    patience_s: float = PATIENCE_S
    coverage: bool = False

    @property
    def processes(self) -> int:
        """The number of parallel runs."""
        if self.jobs is not None:
            return self.jobs
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

    def check(self) -> None:
        """Raise `CxbridgeError` if an option is invalid on this system."""
        if self.jobs is not None and self.jobs < 1:
            raise CxbridgeError(f"--jobs cannot be {self.jobs}", hint="use 1 or more")
        if not self.patience_s > 0:
            raise CxbridgeError(f"--patience cannot be {self.patience_s:g}", hint="use seconds, more than 0")
        if self.fork and not HAS_FORK:
            raise CxbridgeError(
                "this system cannot fork", hint="leave --fork out: each run starts from the beginning"
            )
