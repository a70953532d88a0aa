"""An executor of skills as a separate process; see docs/skill-board.md."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge.blackboard import BlackBoard, EventKind, Listener
from cxbridge.blackboard.errors import WriterActiveError
from cxbridge.daemon.services.options import ExecutorOptions
from cxbridge.daemon.services.service import ReadyCallback, Service, do_nothing
from cxbridge.errors import SkillerError
from cxbridge.events import Sink
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.skiller.board.executor import ExecutorContext, load_executor
from cxbridge.skiller.board.host import ExecutorHost, make_host

if TYPE_CHECKING:
    from cxbridge.interfaces.instance import Interface, Message

PERIOD_S = 1 / 30  # seconds between steps, the period of a daemon's main loop

PATIENCE_S = 5.0
"""The seconds to wait for the end of a predecessor with the same id.

A killed process does not end its session with the server, which notices the end late.
"""

_RETRY_INTERVAL_S = 0.1  # seconds between attempts to open the interface


class _MessageSignal(Listener):
    """Signals the arrival of messages, so that they do not wait for the next step."""

    def __init__(self) -> None:
        self.arrived = threading.Event()

    def message_received(self, interface: Interface, message: Message) -> bool:  # noqa: ARG002 - a listener's signature
        self.arrived.set()
        return True


def run_executor(
    options: ExecutorOptions,
    *,
    console: Sink | None = None,
    on_ready: ReadyCallback = do_nothing,
) -> None:
    """Serve an executor until a signal: SIGINT, SIGTERM or SIGHUP.

    :param console: gets the log lines.
    :param on_ready: called with a stop function when the executor is on the blackboard.
    :raises CxbridgeError: if the class does not exist, no server answers at the URL, or another process has
        the id.
    :raises SkillerError: if another process takes over the id later.
    """
    settings = parse_settings(options.settings)
    executor_class = load_executor(options.target, Path.cwd())
    name = options.name or f"{options.agent}-{executor_class.__name__.lower()}"
    message_signal = _MessageSignal()
    with Service(console, on_ready) as service:
        service.set_wake_function(message_signal.arrived.set)
        log = service.bus.logger(name)
        board = service.open_blackboard(options.url, InterfaceRegistry(options.interface_dirs))
        context = ExecutorContext(options.agent, board, service.clock, log, settings, Path.cwd())
        host = _wait_for_host(lambda: make_host(executor_class, context, name), service.stopped)
        if host is None:
            return
        service.callback(host.close)
        host.listen(message_signal, EventKind.MESSAGE_RECEIVED)
        status = f"{name} executes {', '.join(executor_class.skills)} for {options.agent} on {options.url}"
        log.info(f"Ready: {status}")
        service.report_ready(status)
        next_step_s = time.monotonic()
        while not service.stopped.is_set():
            host.exchange()
            if time.monotonic() >= next_step_s:
                next_step_s = time.monotonic() + PERIOD_S
                host.step()
            if not host.valid:
                raise SkillerError(f"another process has taken over the executor {name}")
            message_signal.arrived.wait(max(0.0, next_step_s - time.monotonic()))
            message_signal.arrived.clear()


def _wait_for_host(open_host: Callable[[], ExecutorHost], stopped: threading.Event) -> ExecutorHost | None:
    """Return the host that ``open_host`` opens, as soon as the executor's interface has no other writer.

    :returns: None if the service stops first.
    :raises WriterActiveError: if the interface still has another writer after `PATIENCE_S`.
    """
    deadline_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return open_host()
        except WriterActiveError:
            if time.monotonic() >= deadline_s:
                raise
        if stopped.wait(_RETRY_INTERVAL_S):
            return None


def parse_settings(assignments: Iterable[str]) -> dict[str, Any]:
    """Return the values of settings of the form ``NAME=VALUE``, by name.

    :raises SkillerError: if a setting has another form.
    """
    from cxbridge.skiller.board.settings import parse_value  # noqa: PLC0415 - needed with settings only

    settings = {}
    for assignment in assignments:
        name, equals, value = assignment.partition("=")
        if not name or not equals:
            raise SkillerError(f"'{assignment}' is not a setting", hint="write NAME=VALUE")
        settings[name] = parse_value(value)
    return settings


def read_executor_states(board: BlackBoard) -> list[dict[str, Any]]:
    """Return the states of the executors for JSON, sorted by agent and id."""
    rows = []
    for interface in board.list("SkillExecutorInterface"):
        if interface.has_writer:
            with board.open_for_reading(interface.type, interface.id, owner="cxbridge skill") as instance:
                instance.read()
                values = instance.as_dict()
            rows.append(
                {
                    "executor": interface.id,
                    "agent": values["agent"],
                    "skills": values["skills"].split(),
                    # a number without an item of the enum has no name
                    "state": getattr(values["state"], "name", str(values["state"])),
                    "skill": values["skill"],
                    "board": values["board"],
                    "master": values["master"],
                }
            )
    return sorted(rows, key=lambda row: (row["agent"], row["executor"]))
