"""The bounds of an exploration, and the options of its execution.

Both classes are groups of command line options: the annotated fields are options of ``cxbridge explore``.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Annotated

import typer

from cxbridge.errors import CxbridgeError
from cxbridge_explore.forking import HAS_FORK


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """The bounds of an exploration, within which its result is complete, and the option to merge states."""

    faults: Annotated[
        int, typer.Option(metavar="K", min=0, help="The maximum number of faults in a run.")
    ] = 1
    depth: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=0,
            help="Choose unusual options only at the first N choice points of a run; by default at all of "
            "them.",
            show_default=False,
        ),
    ] = None
    merge: Annotated[bool, typer.Option("--merge/--no-merge", help="Explore equal states only once.")] = True


@dataclass(frozen=True, kw_only=True)
class ExecutionOptions:
    """Options of the execution, of which only the time limit can influence the result.

    :param cpu_limit_s: its default is chosen freely, far above the time of a usual loop.
    :param coverage: whether to record the used parts of the agent.
    """

    jobs: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            help="The number of parallel runs; by default one per core.",
            show_default=False,
        ),
    ] = None
    fork: Annotated[
        bool | None,
        typer.Option(
            "--fork/--no-fork",
            help="Fork runs at choices, or start each run from the beginning; by default fork if possible.",
            show_default=False,
        ),
    ] = None
    cpu_limit_s: Annotated[
        float,
        typer.Option(
            "--patience",
            metavar="S",
            help="The limit of a run's processor time from one choice to the next, in seconds.",
        ),
    ] = 60.0
    coverage: bool = False

    @property
    def uses_fork(self) -> bool:
        """Whether to fork runs: as requested, or by default if the system can."""
        return HAS_FORK if self.fork is None else self.fork

    @property
    def process_count(self) -> int:
        """The number of parallel runs: as requested, or by default one per core."""
        # In a container, a process may use fewer cores than the machine has.
        usable_cores = (
            os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)
        )
        return self.jobs or len(usable_cores)

    def check(self) -> None:
        """Raise `CxbridgeError` if an option is invalid, or impossible on this system."""
        if not self.cpu_limit_s > 0:  # also refuses NaN
            raise CxbridgeError(
                f"--patience cannot be {self.cpu_limit_s:g}", hint="use a number of seconds greater than 0"
            )
        if self.fork and not HAS_FORK:
            raise CxbridgeError(
                "this system cannot fork", hint="omit --fork; each run then starts from the beginning"
            )
