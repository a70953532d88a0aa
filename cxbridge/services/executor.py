"""An executor of skills as a process of its own; see docs/skill-board.md."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge.blackboard import BlackBoard, EventKind, Listener
from cxbridge.blackboard.errors import WriterActiveError
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import RealClock
from cxbridge.errors import SkillerError
from cxbridge.events import EventBus, LogLine, Sink
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.process.interrupt import Interrupt
from cxbridge.process.systemd import Notifier
from cxbridge.skiller.board.executor import ExecutorContext
from cxbridge.skiller.board.host import ExecutorHost, make_host
from cxbridge.skiller.board.loading import load_executor

if TYPE_CHECKING:
    from cxbridge.interfaces.instance import Interface, Message

PERIOD_S = 1 / 30
"""Seconds from a step to the next."""

PATIENCE_S = 5.0
"""Seconds that a predecessor of the same id has to be gone: its death may not have been noticed yet."""

_AGAIN_S = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class ExecutorOptions:
    """The options of ``cxbridge skill executor``; see its help.

    :param target: ``MODULE:CLASS`` or ``FILE.py:CLASS``.
    :param name: id of the executor's interface; empty: ``AGENT-CLASS``.
    :param settings: for the class.
    """

    target: str
    agent: str
    url: str
    name: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)
    interface_dirs: tuple[Path, ...] = ()


class _Mail(Listener):
    """Signals that a message has come, so that nothing waits for the next step."""

    def __init__(self) -> None:
        self.came = threading.Event()

    def message_received(self, interface: Interface, message: Message) -> bool:  # noqa: ARG002
        """Wake up who waits."""
        self.came.set()
        return True


def run_executor(
    options: ExecutorOptions,
    *,
    console: Sink | None = None,
    on_ready: Callable[[Callable[[], None]], None] = lambda _stop: None,
) -> None:
    """Serve an executor until SIGINT or SIGTERM.

    :param console: gets the log lines.
    :param on_ready: called when the executor is on the blackboard, with what stops it.
    :raises CxbridgeError: when there is no such class, nobody at the URL, or the id is taken.
    """
    kind = load_executor(options.target, Path.cwd())
    name = options.name or f"{options.agent}-{kind.__name__.lower()}"
    clock = RealClock()
    bus = EventBus(clock)
    if console is not None:
        bus.subscribe(console, LogLine)
    log, notifier, mail = bus.logger(name), Notifier(), _Mail()
    stopped = threading.Event()

    def stop() -> None:
        stopped.set()
        mail.came.set()

    with Interrupt(stop, service=True), ExitStack() as stack:
        registry = InterfaceRegistry(options.interface_dirs)
        board = stack.enter_context(open_blackboard(options.url, registry, clock, bus))
        context = ExecutorContext(options.agent, board, clock, log, options.settings, Path.cwd())
        host = _patiently(lambda: make_host(kind, context, name), stopped)
        if host is None:
            return
        stack.callback(host.close)
        host.listen(mail, EventKind.MESSAGE_RECEIVED)
        text = f"{name} executes {', '.join(kind.skills)} for {options.agent} on {options.url}"
        notifier.ready(text)
        log.info(f"Ready: {text}")
        on_ready(stop)
        next_step_s = time.monotonic()
        while not stopped.is_set():
            host.exchange()
            if time.monotonic() >= next_step_s:
                next_step_s = time.monotonic() + PERIOD_S
                host.step()
            if not host.valid:
                raise SkillerError(f"somebody else is the executor {name} now")
            mail.came.wait(max(0.0, next_step_s - time.monotonic()))
            mail.came.clear()
        notifier.stopping()


def _patiently(make: Callable[[], ExecutorHost], stopped: threading.Event) -> ExecutorHost | None:
    """Make something as soon as its place is free; None when it is to end before.

    :raises WriterActiveError: when it does not become free.
    """
    deadline_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return make()
        except WriterActiveError:
            if time.monotonic() >= deadline_s:
                raise
        if stopped.wait(_AGAIN_S):
            return None


def parse_settings(texts: Iterable[str]) -> dict[str, Any]:
    """Return settings from ``NAME=VALUE``.

    :raises SkillerError: when one is of another form.
    """
    from cxbridge.skiller.board.settings import value_of  # noqa: PLC0415 - for those who set something

    settings = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not name or not equals:
            raise SkillerError(f"'{text}' sets nothing", hint="write NAME=VALUE")
        settings[name] = value_of(value)
    return settings


def board_rows(board: BlackBoard) -> list[dict[str, Any]]:
    """Return what executors say of themselves, by agent."""
    rows = []
    for info in board.list("SkillExecutorInterface"):
        if not info.has_writer:
            continue
        with board.open_for_reading(info.type, info.id, owner="cxbridge skill") as instance:
            instance.read()
            values = instance.as_dict()
        rows.append(
            {
                "executor": info.id,
                "agent": values["agent"],
                "skills": values["skills"].split(),
                "state": getattr(values["state"], "name", str(values["state"])),
                "skill": values["skill"],
                "board": values["board"],
                "master": values["master"],
            }
        )
    return sorted(rows, key=lambda row: (row["agent"], row["executor"]))
