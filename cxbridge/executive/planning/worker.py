"""The planner process: ``python -m cxbridge.executive.planning.worker``.

Jobs arrive on standard input, and results leave on the original standard output. A planner's own output goes
to standard error. :class:`cxbridge.executive.planning.process.PlannerProcess` is the other side.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

from cxbridge.errors import CxbridgeError
from cxbridge.executive.planning.errors import PlanningError
from cxbridge.executive.planning.folder import PREFIX
from cxbridge.executive.planning.jobs import Job, receive, send
from cxbridge.executive.planning.planner import PlannedAction, PlanResult, PlanStatus
from cxbridge.executive.planning.validation.plan import check_plan

_LOOK_S = 1.0


def plan(job: Job) -> PlanResult:
    """Run a job. Errors become part of the result."""
    start = time.perf_counter()
    name = job.planner.name
    try:
        job.planner.seconds = job.seconds
        actions = job.planner.solve(job.domain, job.problem)
        if actions is not None:
            _check(name, job, actions)
    except CxbridgeError as error:
        result = PlanResult(PlanStatus.FAILED, name, message=str(error))
    except MemoryError:
        result = PlanResult(PlanStatus.FAILED, name, message=f"{name} used up the memory it may have")
    except RecursionError:
        result = PlanResult(PlanStatus.FAILED, name, message=f"{name} went too deep")
    except Exception as error:  # noqa: BLE001  a planner may raise anything
        text = f"{name} failed: {type(error).__name__}: {error}"
        result = PlanResult(PlanStatus.FAILED, name, message=text)
    else:
        if actions is None:
            from cxbridge.executive.planning.compile.relaxed import why_none  # noqa: PLC0415 - seldom needed

            text = f"{name} says that there is no plan{why_none(job.domain, job.problem)}"
            result = PlanResult(PlanStatus.NO_PLAN, name, message=text)
        else:
            result = PlanResult(PlanStatus.PLANNED, name, actions)
    seconds = time.perf_counter() - start
    return PlanResult(result.status, result.planner, result.actions, result.message, seconds)


def _check(name: str, job: Job, actions: tuple[PlannedAction, ...]) -> None:
    """Refuse an invalid plan."""
    check = check_plan(job.domain, job.problem, actions)
    if not check.holds:
        raise PlanningError(f"{name} made a plan that does not hold: {check.failure}")


def _limit(memory: int) -> None:
    """Limit the address space of this process. Windows has no such limit."""
    if sys.platform != "win32":
        import resource  # noqa: PLC0415

        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (memory, hard))


def _end_with_parent(parent: int) -> None:
    """End this process and its children when the parent has ended, even during a job."""
    while os.getppid() == parent:
        time.sleep(_LOOK_S)
    folder = Path(tempfile.gettempdir())
    if folder.name.startswith(PREFIX):  # only then the folder belongs to this process alone
        shutil.rmtree(folder, ignore_errors=True)
    if sys.platform != "win32":
        os.killpg(os.getpgrp(), signal.SIGKILL)


def main() -> None:
    """Run jobs until standard input ends."""
    if hasattr(os, "killpg"):
        threading.Thread(target=_end_with_parent, args=(os.getppid(),), daemon=True).start()
    jobs = sys.stdin.buffer
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    while True:
        try:
            job = receive(jobs)
        except EOFError:
            return
        assert isinstance(job, Job)
        if job.memory:
            _limit(job.memory)
        send(answers, plan(job))


if __name__ == "__main__":
    main()
