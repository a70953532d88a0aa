"""The state of the feature robot_memory for one environment, and the events that wait for it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

from cxbridge.clock import split_us
from cxbridge.errors import ClipsError
from cxbridge.events import Logger
from cxbridge.executive.features.robmem_handles import Handles
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.executive.robmem.errors import RobotMemoryError
from cxbridge.executive.robmem.memory import RobotMemory
from cxbridge.executive.robmem.store import Change, Store

_THREADS = 4


class RobotMemoryContext:
    """One environment with a robot memory.

    Events and answers may come from any thread. They wait until the environment's next run begins, and are
    asserted then in the order in which they came.
    """

    def __init__(self, env: ClipsEnvironment, memory: RobotMemory) -> None:
        self.env = env
        self.memory = memory
        self.store: Store = memory.store
        self.log: Logger = env.bus.logger(f"RobotMemoryCLIPS|{env.name}")
        self.handles = Handles(self.log)
        self._inbox: deque[Callable[[], None]] = deque()
        self._last_event_us = 0
        self._tasks: dict[str, Future[None]] = {}
        self._threads: ThreadPoolExecutor | None = None

    def deliver(self) -> None:
        """Assert received documents. The environment's lock must be held."""
        for _ in range(len(self._inbox)):
            self._inbox.popleft()()

    def enqueue_fact(self, relation: str, *fields: Value) -> None:
        """Let an ordered fact be asserted before the next run."""
        self._inbox.append(lambda: self._assert(relation, fields))

    def enqueue_event(self, name: str, change: Change) -> None:
        """Let the facts of an event be asserted before the next run."""
        received_us = self.env.bus.clock.now_us()
        self._inbox.append(lambda: self._assert_event(name, change, received_us))

    def start(self, key: str, operation: Callable[[], None]) -> bool:
        """Do something that may take its time; not while one of the same key is under way.

        A store in this process answers at once, so it is done at once: runs repeat.

        :returns: whether it was started.
        """
        running = self._tasks.get(key)
        if running is not None and not running.done():
            return False
        if self.store.is_local:
            operation()
            return True
        if self._threads is None:
            self._threads = ThreadPoolExecutor(_THREADS, thread_name_prefix="robot-memory")
        self._tasks[key] = self._threads.submit(self._guarded, key, operation)
        return True

    def _guarded(self, key: str, operation: Callable[[], None]) -> None:
        try:
            operation()
        except Exception as error:  # noqa: BLE001  nobody asks for the result
            self.log.error(f"{key}: {type(error).__name__}: {error}")

    def attempt(self, name: str, operation: Callable[[], bool]) -> bool:
        """Whether an operation succeeded; an error goes to the log, and is none."""
        try:
            return operation()
        except RobotMemoryError as error:
            self.log.warn(f"{name} failed: {error}")
            return False

    def close(self) -> None:
        """Stop reporting."""
        if self._threads is not None:
            self._threads.shutdown(wait=True, cancel_futures=True)
        self._inbox.clear()

    def _assert(self, relation: str, fields: tuple[Value, ...]) -> None:
        try:
            self.env.assert_ordered(relation, fields)
        except ClipsError as error:
            self.log.warn(f"Cannot assert ({relation} ...): {error}")

    def _assert_event(self, name: str, change: Change, received_us: int) -> None:
        # each has a different time: rules take the oldest first
        self._last_event_us = max(received_us, self._last_event_us + 1)
        if self.env.assert_string(f"({name})") is None:
            self.log.warn(f"Asserting ({name}) failed: is it a name?")
        slots: dict[str, Value] = {
            "name": name,
            "rcvd-at": split_us(self._last_event_us),
            "ptr": self.handles.add(change),
        }
        try:
            self.env.assert_fact("robmem-trigger", slots)
        except ClipsError as error:
            self.log.warn(f"Asserting robmem-trigger fact failed: {error}")


FAIL, OK, SUCCESS = Symbol("FAIL"), Symbol("OK"), Symbol("SUCCESS")
