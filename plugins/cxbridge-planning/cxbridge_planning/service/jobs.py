"""The job of a planner process (:mod:`.worker`), which it receives from its owner (:mod:`.process`)."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Final

from cxbridge.executive.pddl.ast import Domain, Problem
from cxbridge_planning.planner import Planner

FOLDER_PREFIX: Final = "cxbridge-planner-"
"""The start of the name of a process' folder for temporary files.

The process removes its folder only if the folder has such a name: another folder may be shared.
"""


@dataclass(frozen=True, slots=True)
class Job:
    """A planning job.

    :param max_memory_bytes: the limit of address space in bytes; 0: no limit.
    :param time_limit_s: the time limit in seconds, from the start of the job; infinite without a limit.
    """

    planner: Planner
    domain: Domain
    problem: Problem
    max_memory_bytes: int = 0
    time_limit_s: float = inf
