"""The planner process: ``python -m cxbridge_planning.service.worker``.

Pickled jobs (:class:`~cxbridge_planning.service.jobs.Job`) arrive on standard input, and pickled results
leave on standard output. A planner's own output goes to standard error, because it would damage the results.
The other side is :class:`cxbridge_planning.service.process.PlannerProcess`.
"""

from __future__ import annotations

import os
import pickle
import shutil
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

from cxbridge.errors import CxbridgeError
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.planner import PlanResult, PlanStatus
from cxbridge_planning.service.jobs import FOLDER_PREFIX, Job
from cxbridge_planning.validation.plan import check_plan

_POLL_S = 1.0  # seconds between checks whether the parent is alive


def run_job(job: Job) -> PlanResult:
    """Return the result of a job. Errors become a result with the status FAILED."""
    start_s = time.perf_counter()
    name = job.planner.name
    status, actions = PlanStatus.FAILED, None
    try:
        job.planner.time_limit_s = job.time_limit_s
        actions = job.planner.solve(job.domain, job.problem)
        status, message = _judge_plan(job, actions)
    except CxbridgeError as error:
        message = str(error)
    except (MemoryError, RecursionError) as error:
        message = f"{name} exceeded the {'memory' if isinstance(error, MemoryError) else 'recursion'} limit"
    except Exception as error:  # noqa: BLE001 - a planner may raise anything
        message = f"{name} failed: {type(error).__name__}: {error}"
    valid_actions = actions or () if status is PlanStatus.PLANNED else ()
    return PlanResult(status, name, valid_actions, message, time.perf_counter() - start_s)


def _judge_plan(job: Job, actions: tuple[PlannedAction, ...] | None) -> tuple[PlanStatus, str]:
    """Return the status of a planner's result, and why there is no valid plan (empty for a valid plan).

    A plan whose check is inconclusive counts as valid.
    """
    name = job.planner.name
    if actions is None:
        from cxbridge_planning.compile.relaxed import no_plan_reason  # noqa: PLC0415 - most problems have a plan

        reason = no_plan_reason(job.domain, job.problem)
        return PlanStatus.NO_PLAN, f"{name} says that there is no plan{reason}"
    # no planner is trusted: an invalid plan would fail in the middle of its execution
    check = check_plan(job.domain, job.problem, actions)
    if check.failure:
        return PlanStatus.FAILED, f"{name} made an invalid plan: {check.failure}"
    return PlanStatus.PLANNED, ""


def _limit_memory(max_bytes: int) -> None:
    """Limit the address space of this process; without effect on Windows, which lacks ``resource``."""
    if sys.platform != "win32":
        import resource  # noqa: PLC0415 - absent on Windows

        _soft_limit, hard_limit = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (max_bytes, hard_limit))


def _end_with_parent(parent_id: int) -> None:
    """End this process and its children when the parent has ended, even during a job."""
    while os.getppid() == parent_id:
        time.sleep(_POLL_S)
    _remove_folder()
    if sys.platform != "win32":
        os.killpg(os.getpgrp(), signal.SIGKILL)


def _remove_folder() -> None:
    """Remove the temporary files, which a killed parent cannot remove."""
    folder = Path(tempfile.gettempdir())
    if folder.name.startswith(FOLDER_PREFIX):  # any other folder may be shared with other processes
        shutil.rmtree(folder, ignore_errors=True)


def main() -> None:
    """Run jobs until standard input ends."""
    # Windows has no killpg, and its getppid names the parent even after its end
    if hasattr(os, "killpg"):
        threading.Thread(target=_end_with_parent, args=(os.getppid(),), daemon=True).start()
    jobs = sys.stdin.buffer
    results = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # from here on, a planner's output goes to standard error
    while True:
        try:
            job = pickle.load(jobs)  # noqa: S301 - only the parent process writes to this pipe
        except EOFError:
            _remove_folder()
            return
        assert isinstance(job, Job)
        if job.max_memory_bytes:
            _limit_memory(job.max_memory_bytes)
        pickle.dump(run_job(job), results)
        results.flush()


if __name__ == "__main__":
    main()
