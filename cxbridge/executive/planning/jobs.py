"""The job of a planner's process, which reads jobs and writes results as pickled values."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Final

from cxbridge.executive.pddl.ast import Domain, Problem
from cxbridge.executive.planning.planner import Planner

FOLDER_PREFIX: Final = "cxbridge-planner-"
"""The start of the name of a process' folder, by which the process knows that the folder is not shared."""


@dataclass(frozen=True, slots=True)
class Job:
    """A planning job.

    :param seconds: the time limit.
    :param memory: the limit of address space in bytes; 0: no limit.
    """

    planner: Planner
    domain: Domain
    problem: Problem
    memory: int = 0
    seconds: float = inf
