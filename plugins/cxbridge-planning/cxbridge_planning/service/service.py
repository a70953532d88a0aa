"""Background planning: concurrent calls in child processes.

A call has a thread, which waits for a free process and tries the planners in order, and a timer, which ends
the call after its timeout. The lock of a call protects its process and result, the lock of the service the
pool of processes. No thread holds both locks, so that threads cannot block each other.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge.executive.pddl.ast import Domain, Problem
from cxbridge_planning.planner import Planner, PlanResult, PlanStatus
from cxbridge_planning.registry import AUTO, choose_planners
from cxbridge_planning.service.attempts import Attempts
from cxbridge_planning.service.jobs import Job
from cxbridge_planning.service.process import PlannerProcess
from cxbridge_planning.settings import DEFAULT_AT_ONCE, DEFAULT_MEMORY, DEFAULT_TIMEOUT

# The share of the remaining time for each planner except the last. A planner gets more time than all later
# planners together.
_TIME_SHARE: Final = 0.6

CANCELLED_TEXT: Final = "planning was cancelled"
"""The message of a cancelled call's result."""


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """A request for a plan.

    :param planner: a planner's name, or ``auto``.
    :param options: the options of a named planner.
    :param timeout: the time limit in seconds, including the wait for a free process.
    """

    domain: Domain
    problem: Problem
    planner: str = AUTO
    options: dict[str, str] = field(default_factory=dict)
    timeout: float = DEFAULT_TIMEOUT


class PlanCall:
    """A call of planners for a request, made by :meth:`PlanningService.call`."""

    def __init__(self, service: PlanningService, request: PlanRequest) -> None:
        self.request = request
        self._service = service
        self._lock = threading.Lock()
        self._done = threading.Event()
        self._result: PlanResult | None = None
        self._process: PlannerProcess | None = None
        self._end_status: PlanStatus | None = None

    @property
    def result(self) -> PlanResult | None:
        """The result; None while running."""
        return self._result

    def wait(self, timeout: float | None = None) -> PlanResult | None:
        """Wait for the result; return None after the timeout."""
        self._done.wait(timeout)
        return self._result

    def cancel(self) -> None:
        """Cancel the call, unless it has a result already."""
        self._end_call(PlanStatus.CANCELLED)

    def run(self) -> None:
        """Make the plan. Called in the thread of the call."""
        start_s = time.monotonic()
        timer = _start_timer(self.request.timeout, lambda: self._end_call(PlanStatus.TIMEOUT))
        attempts = Attempts(self.request.planner)
        try:
            result = self._try_planners(attempts, start_s + self.request.timeout)
        except OSError as error:
            message = f"no process for a planner can be started: {error}"
            result = PlanResult(PlanStatus.FAILED, self.request.planner, message=message)
        timer.cancel()
        seconds = time.monotonic() - start_s
        with self._lock:  # a cancellation from now on comes too late
            end_status = self._end_status
            # a plan that arrives together with the timeout counts
            has_plan = end_status is PlanStatus.TIMEOUT and result.status is PlanStatus.PLANNED
            if end_status is not None and not has_plan:
                message = {
                    PlanStatus.TIMEOUT: f"no plan within {self.request.timeout:g} s{attempts.advice}",
                    PlanStatus.CANCELLED: CANCELLED_TEXT,
                }[end_status]
                result = PlanResult(end_status, self.request.planner, message=message, seconds=seconds)
            self._result = result
        self._done.set()

    def _try_planners(self, attempts: Attempts, deadline_s: float) -> PlanResult:
        """Try the planners in order until a planner has a plan or proves that there is none.

        The result of a call that was stopped has no meaning.

        :param deadline_s: the end of the time limit on the monotonic clock.
        """
        request = self.request
        try:
            attempts.choice = choose_planners(
                request.planner, request.domain, request.problem, request.options
            )
        except CxbridgeError as error:
            return PlanResult(PlanStatus.FAILED, request.planner, message=str(error))
        for planner in attempts.choice.planners:
            is_last = planner is attempts.choice.planners[-1]
            time_limit_s = (deadline_s - time.monotonic()) * (1.0 if is_last else _TIME_SHARE)
            result = self._try_planner(planner, time_limit_s, is_last=is_last)
            if self.was_stopped or attempts.add_result(planner, result):
                return attempts.with_reasons(result)
        return attempts.final_result()

    def _try_planner(self, planner: Planner, time_limit_s: float, *, is_last: bool) -> PlanResult:
        """Try one planner.

        :param is_last: whether no planner follows, so that the timer of the call ends this attempt.
        """
        request, name = self.request, planner.name
        process = self._service.take_process(self)
        if process is None:
            return PlanResult(PlanStatus.CANCELLED, name)
        with self._lock:
            if self._end_status is None:
                self._process = process
        if self._process is None:  # the call ended while it waited for the process
            self._service.return_process(process)
            return PlanResult(PlanStatus.CANCELLED, name)
        timer = None if is_last else _start_timer(time_limit_s, process.kill)
        job = Job(planner, request.domain, request.problem, self._service.memory, time_limit_s)
        result = process.run(job)
        if timer is not None:
            timer.cancel()
        with self._lock:
            self._process = None
        if process.is_killed and result.status is PlanStatus.FAILED:
            result = self._best_result(planner, process, time_limit_s)
        self._service.return_process(process)
        return result

    def _best_result(self, planner: Planner, process: PlannerProcess, time_limit_s: float) -> PlanResult:
        """Return the result of a planner whose process was killed: its best plan so far, or a timeout.

        The result of a cancelled call has no meaning.
        """
        from cxbridge_planning.validation.plan import check_plan  # noqa: PLC0415 - few processes are killed

        name, domain, problem = planner.name, self.request.domain, self.request.problem
        if self._end_status is not PlanStatus.CANCELLED:
            actions = planner.best_so_far(process.folder, domain, problem)
            if actions is not None and not check_plan(domain, problem, actions).failure:
                why = f"the time limit was reached: the best plan within {time_limit_s:.3g} s"
                return PlanResult(PlanStatus.PLANNED, name, actions, why=why)
        return PlanResult(
            PlanStatus.TIMEOUT, name, message=f"{name} found no plan within {time_limit_s:.3g} s"
        )

    @property
    def was_stopped(self) -> bool:
        """Whether the call was cancelled or timed out."""
        return self._end_status is not None

    def _end_call(self, status: PlanStatus) -> None:
        with self._lock:
            if self._result is None and self._end_status is None:
                self._end_status = status
                if self._process is not None:
                    self._process.kill()
        self._service.wake_waiting_calls()


def _start_timer(seconds: float, function: Callable[[], None]) -> threading.Timer:
    timer = threading.Timer(seconds, function)
    timer.daemon = True
    timer.start()
    return timer


class PlanningService(Closing):
    """Makes plans in child processes.

    :param at_once: the number of concurrent calls; further calls wait.
    :param memory: the limit of address space per process in bytes; 0: no limit.
    """

    def __init__(self, at_once: int = DEFAULT_AT_ONCE, memory: int = DEFAULT_MEMORY) -> None:
        self.memory = memory
        self._free_slot_count = at_once
        self._idle_processes: deque[PlannerProcess] = deque()
        self._calls: set[PlanCall] = set()
        self._pool_changed = threading.Condition()
        self._is_closed = False

    def warm_up(self) -> None:
        """Start a process in advance, so that the first call does not wait for the process.

        :raises OSError: if the process cannot be started.
        """
        with self._pool_changed:
            if not self._idle_processes and not self._is_closed:
                self._idle_processes.append(PlannerProcess())

    def call(self, request: PlanRequest) -> PlanCall:
        """Start a call; a closed service cancels the call."""
        call = PlanCall(self, request)
        with self._pool_changed:
            self._calls = {running for running in self._calls if running.result is None} | {call}
            is_closed = self._is_closed
        if is_closed:  # without the lock, which cancel needs
            call.cancel()
        threading.Thread(target=call.run, name="planning", daemon=True).start()
        return call

    def plan(self, request: PlanRequest) -> PlanResult:
        """Make a plan, wait for the result and return it."""
        result = self.call(request).wait()
        assert result is not None
        return result

    def close(self) -> None:
        """Cancel all planning calls and stop the processes; without an effect on a closed service."""
        with self._pool_changed:
            self._is_closed = True
            calls = list(self._calls)
        for call in calls:  # without the lock, which calls need to end
            call.cancel()
            call.wait()
        with self._pool_changed:
            idle_processes, self._idle_processes = self._idle_processes, deque()
        for process in idle_processes:
            process.close()

    def take_process(self, call: PlanCall) -> PlannerProcess | None:
        """Wait for a free slot, and return an idle or a new process; return None if the call was stopped.

        :raises OSError: if a process cannot be started.
        """
        with self._pool_changed:
            self._pool_changed.wait_for(lambda: self._free_slot_count > 0 or call.was_stopped)
            if call.was_stopped:
                return None
            self._free_slot_count -= 1
            while self._idle_processes:  # an idle process may have been killed by the system
                process = self._idle_processes.popleft()
                if process.is_alive:
                    return process
                process.close()
        try:
            return PlannerProcess()
        except OSError:
            with self._pool_changed:
                self._free_slot_count += 1
                self._pool_changed.notify_all()
            raise

    def return_process(self, process: PlannerProcess) -> None:
        """Return a process to the pool."""
        with self._pool_changed:
            self._free_slot_count += 1
            self._pool_changed.notify_all()
            if process.is_alive and not self._is_closed:
                self._idle_processes.append(process)
                return
        process.close()

    def wake_waiting_calls(self) -> None:
        """Wake the waiting calls, which may have ended."""
        with self._pool_changed:
            self._pool_changed.notify_all()
