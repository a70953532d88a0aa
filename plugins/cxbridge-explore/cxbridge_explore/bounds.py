"""What an exploration covers, and how it goes about it."""

from __future__ import annotations

import os
from dataclasses import dataclass

from cxbridge.errors import CxbridgeError
from cxbridge.process.forking import HAS_FORK

PATIENCE_S = 60.0
"""Seconds of processor time that a run may take from one choice to the next."""


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """The bounds of an exploration: a result is complete up to them.

    :param faults: how many faults a run may meet.
    :param depth: at how many choice points, from the first, the world may do other than usual; None: at all.
    :param merge: whether states that are equal are visited once.
    """

    faults: int = 1
    depth: int | None = None
    merge: bool = True

    def check(self) -> None:
        """Raise :class:`CxbridgeError` when a bound is invalid."""
        for name, value in (("faults", self.faults), ("depth", self.depth or 0)):
            if value < 0:
                raise CxbridgeError(f"--{name} cannot be {value}", hint="use 0 or more")


@dataclass(frozen=True, kw_only=True)
class Means:
    """How an exploration is carried out; the result does not depend on it.

    :param jobs: the number of runs at the same time; None: the number of cores.
    :param fork: whether to fork; else each run begins at the beginning.
    :param patience_s: seconds of processor time that a run may take from one choice to the next.
    :param coverage: whether the used parts of the agent are noted.
    """

    jobs: int | None = None
    fork: bool = HAS_FORK
    patience_s: float = PATIENCE_S
    coverage: bool = False

    @property
    def processes(self) -> int:
        """The number of runs at the same time."""
        if self.jobs is not None:
            return self.jobs
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

    def check(self) -> None:
        """Raise :class:`CxbridgeError` when an option is invalid here."""
        if self.jobs is not None and self.jobs < 1:
            raise CxbridgeError(f"--jobs cannot be {self.jobs}", hint="use 1 or more")
        if not self.patience_s > 0:
            raise CxbridgeError(f"--patience cannot be {self.patience_s:g}", hint="use seconds, more than 0")
        if self.fork and not HAS_FORK:
            raise CxbridgeError(
                "this system cannot fork", hint="leave --fork out: each run starts from the beginning"
            )
