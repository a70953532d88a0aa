"""The feature ``robot_memory`` in one environment: handles, threads, and a queue of facts to assert."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

from cxbridge.clock import split_us
from cxbridge.events import Logger
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value
from cxbridge_robot_memory.errors import RobotMemoryError
from cxbridge_robot_memory.feature.handles import Handles
from cxbridge_robot_memory.memory import RobotMemory
from cxbridge_robot_memory.store import ChangeEvent, Store

FAIL, OK, SUCCESS = Symbol("FAIL"), Symbol("OK"), Symbol("SUCCESS")
"""The outcomes of operations in facts."""

_MAX_THREADS = 4  # operations on a remote store that may run at the same time


class RobotMemoryContext:
    """The robot memory of one environment.

    Events and replies may arrive in any thread. The environment's next run asserts them in their order of
    arrival.
    """

    def __init__(self, env: ClipsEnvironment, memory: RobotMemory) -> None:
        self.env = env
        self.memory = memory
        self.store: Store = memory.open()
        self.log: Logger = env.bus.logger(f"RobotMemoryCLIPS|{env.name}")
        self.handles = Handles()
        self._assertions: deque[Callable[[], object]] = deque()
        self._last_event_us = 0
        self._operations: dict[str, Future[None]] = {}  # by key
        self._threads: ThreadPoolExecutor | None = None

    def assert_queued_facts(self) -> None:
        """Assert the queued facts. The environment must be locked."""
        # only the facts of this moment, since other threads may add facts at the same time
        for _ in range(len(self._assertions)):
            self._assertions.popleft()()

    def enqueue_fact(self, relation: str, *fields: Value) -> None:
        """Queue an ordered fact for the next run."""
        self._assertions.append(lambda: self.env.assert_ordered(relation, fields))

    def enqueue_event(self, name: str, change: ChangeEvent) -> None:
        """Queue the facts of an event for the next run.

        :param name: the name of the trigger.
        """
        received_us = self.env.bus.clock.now_us()
        self._assertions.append(lambda: self._assert_event(name, change, received_us))

    def start_operation(self, key: str, operation: Callable[[], None]) -> bool:
        """Start a long operation, unless an operation with the same key is running.

        :returns: whether the operation was started.
        """
        last_operation = self._operations.get(key)
        if last_operation is not None and not last_operation.done():
            return False
        # a local store is fast, and its operation in this thread makes runs reproducible
        if self.store.is_local:
            operation()
            return True
        if self._threads is None:
            self._threads = ThreadPoolExecutor(_MAX_THREADS, thread_name_prefix="robot-memory")
        self._operations[key] = self._threads.submit(self._run_logged, key, operation)
        return True

    def _run_logged(self, key: str, operation: Callable[[], None]) -> None:
        try:
            operation()
        except Exception as error:  # noqa: BLE001 - the error of a thread would be lost
            self.log.error(f"{key}: {type(error).__name__}: {error}")

    def try_operation(self, name: str, operation: Callable[[], bool]) -> bool:
        """Run an operation, and return its result; log its error and return False if it fails."""
        try:
            return operation()
        except RobotMemoryError as error:
            self.log.warn(f"{name} failed: {error}")
            return False

    def close(self) -> None:
        """Wait for the running operations, and drop the waiting operations and the queued facts."""
        if self._threads is not None:
            self._threads.shutdown(wait=True, cancel_futures=True)
        self._assertions.clear()

    def _assert_event(self, name: str, change: ChangeEvent, received_us: int) -> None:
        # no two events have the same time, because rules handle the oldest event first
        self._last_event_us = max(received_us, self._last_event_us + 1)
        # as in Fawkes, an event is two facts: one without slots, whose relation is the trigger's name, and a
        # robmem-trigger
        if self.env.assert_string(f"({name})") is None:
            self.log.warn(f"Asserting ({name}) failed: is it a valid relation name?")
        slots: dict[str, Value] = {
            "name": name,
            "rcvd-at": split_us(self._last_event_us),
            "ptr": self.handles.add(change),
        }
        self.env.assert_fact("robmem-trigger", slots)
