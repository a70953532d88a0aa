"""The bounds of an exploration, and the options of its execution; both are options of the command."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Annotated

import typer

from cxbridge.errors import CxbridgeError
from cxbridge_explore.forking import HAS_FORK


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """The bounds of an exploration. The result is complete within them.

    :param depth: the number of first choice points with unusual options; None for all.
    """

    faults: Annotated[int, typer.Option(metavar="K", help="How many faults a run may meet.")] = 1
    depth: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Only at the first N choice points the world does other than usual; all by default.",
            show_default=False,
        ),
    ] = None
    merge: Annotated[bool, typer.Option("--merge/--no-merge", help="Visit states that are equal once.")] = (
        True
    )

    def check(self) -> None:
        """Raise `CxbridgeError` if a bound is invalid."""
        for name, value in (("faults", self.faults), ("depth", self.depth or 0)):
            if value < 0:
                raise CxbridgeError(f"--{name} cannot be {value}", hint="use 0 or more")


@dataclass(frozen=True, kw_only=True)
class ExecutionOptions:
    """Options without influence on the result.

    :param fork: whether to fork runs; None to fork where the system can.
    :param patience_s: the limit of a run's processor time between two choices.
    :param coverage: whether to record the used parts of the agent.
    """

    jobs: Annotated[
        int | None,
        typer.Option(metavar="N", help="Runs at the same time; one a core by default.", show_default=False),
    ] = None
    fork: Annotated[
        bool | None,
        typer.Option(
            "--fork/--no-fork",
            help="Fork a run at its choices, or begin each run at the beginning; fork where the system can.",
            show_default=False,
        ),
    ] = None
    patience_s: Annotated[
        float,
        typer.Option(
            "--patience",
            metavar="S",
            help="Seconds of processor time that a run may take from one choice to the next.",
        ),
    ] = 60.0
    coverage: bool = False

    @property
    def forks(self) -> bool:
        """Whether runs are forked."""
        return HAS_FORK if self.fork is None else self.fork

    @property
    def processes(self) -> int:
        """The number of parallel runs."""
        if self.jobs is not None:
            return self.jobs
        # In a container, a process may use fewer cores than the machine has.
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
