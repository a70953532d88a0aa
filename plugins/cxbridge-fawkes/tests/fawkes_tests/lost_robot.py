"""A robot that a test can lose and bring back, and an agent that drives it: a run or a daemon."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from cxbridge.run import RunOptions, run_scenario
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from cxbridge_fawkes.gateway.service import run_gateway
from cxbridge_fawkes.network.server import FawkesServer
from tests.blackboard.zmq.support import eventually
from tests.run.mini import write_scenario

WAIT_S = 8
"""Seconds after which a test gives up."""

TIMEOUT_S = 0.6
"""Seconds that a client waits for an answer of the robot."""

SKILL_S = 0.9
"""Seconds that a skill of the robot takes."""

AGENT = """
(defglobal ?*SKILL-ACQUIRE-CONTROL-RETRY-INTERVAL-SEC* = 0.3)
(defrule try-begin (executive-initialized) (not (begun)) =>
  (assert (begun) (skiller-control) (domain-operator (name act) (param-names text)))
  (goal-tree-assert-retry TRY 3 (assert (goal (id G) (class G)))))
(defrule try-select ?g <- (goal (class TRY) (mode FORMULATED)) (skiller-control (acquired TRUE)) =>
  (modify ?g (mode SELECTED)))
(defrule try-expand ?g <- (goal (id G) (mode SELECTED)) =>
  (assert (plan (id P) (goal-id G) (type SEQUENTIAL)))
  (assert (plan-action (id 1) (plan-id P) (goal-id G) (action-name act)
                       (param-names text) (param-values "x")))
  (modify ?g (mode EXPANDED)))
(defrule try-commit ?g <- (goal (id G) (mode EXPANDED)) => (modify ?g (mode COMMITTED) (committed-to P)))
(defrule try-dispatch ?g <- (goal (id G) (mode COMMITTED)) => (modify ?g (mode DISPATCHED)))
(defrule try-evaluate ?g <- (goal (mode FINISHED)) => (modify ?g (mode EVALUATED)))
(defrule try-end ?g <- (goal (class TRY) (mode EVALUATED) (outcome ?outcome)) =>
  (printout t "TRY has " ?outcome crlf)
  (modify ?g (mode RETRACTED)))
"""
"""One skill, at most three tries. It asks for control again sooner than the core does."""


class Wire(threading.Thread):
    """Carries bytes between clients and the robot; closed, it stands still as if the robot's process did."""

    def __init__(self, there: int) -> None:
        super().__init__(daemon=True)
        self._there = there
        self.is_open = threading.Event()
        self.is_open.set()
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = self._listening.getsockname()[1]
        self.start()

    def run(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listening.accept()
                threading.Thread(target=self._connect, args=(client,), daemon=True).start()

    def _connect(self, client: socket.socket) -> None:
        self.is_open.wait()
        try:
            robot = socket.create_connection(("127.0.0.1", self._there))
        except OSError:
            client.close()
            return
        for source, sink in ((client, robot), (robot, client)):
            threading.Thread(target=self._carry, args=(source, sink), daemon=True).start()

    def _carry(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(65536):
                self.is_open.wait()
                sink.sendall(data)
        with suppress(OSError):
            sink.shutdown(socket.SHUT_RDWR)
        source.close()  # the other direction closes the sink

    def close(self) -> None:
        self.is_open.set()
        self._listening.close()


class Robot:
    """A blackboard with a Skiller, which holds on when a client's skill string is in a certain state.

    :param state: ``asked`` for control, skill string ``sent``, ``running``, ``ended``.
    """

    def __init__(self, state: str) -> None:
        self._state = state
        self.reached = threading.Event()
        self._done = threading.Event()
        self._frozen = threading.Event()
        self._port = 0
        self.tries = 0
        self._start()
        self.wire = Wire(self._port)
        self.url = f"fawkes://127.0.0.1:{self.wire.port}"
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _start(self) -> None:
        self.board = LocalBlackBoard(InterfaceRegistry(), RealClock())
        self.watch: Any = self.board.open_for_reading(SkillerInterface, "Skiller", owner="keeper")
        self._load()
        self._server = FawkesServer(self.board, port=self._port)
        self._port = self._server.port
        self._server.start()

    def _load(self) -> None:
        seconds = 0.05 if self.reached.is_set() or self._state == "ended" else SKILL_S
        self.skiller = SkillerSimulator(
            self.board, RealClock(), EventBus(RealClock()), [StaticEstimator(seconds=seconds)]
        )

    def _run(self) -> None:
        while not self._done.wait(0.002):
            if not self._frozen.is_set():
                with suppress(Exception):  # it was killed in the middle of its loop
                    self._loop()

    def _loop(self) -> None:
        waiting = [message.type for message in self.skiller._interface.msgq_iter()]
        holds = {"asked": "AcquireControlMessage", "sent": "ExecSkillMessage"}
        if not self.reached.is_set() and holds.get(self._state) in waiting:
            self.hold()
            return
        self.skiller.loop()
        self.tries += waiting.count("ExecSkillMessage")
        shown = self.skiller._interface.status.name
        if (
            not self.reached.is_set()
            and {"S_RUNNING": "running", "S_FINAL": "ended"}.get(shown) == self._state
        ):
            self.hold()

    def hold(self) -> None:
        """Do nothing until something happens to it."""
        self._frozen.set()
        self.reached.set()

    # -- what happens to it

    def kill(self) -> None:
        """End as by SIGKILL: nothing is written any more."""
        self._frozen.set()
        self.board.shutdown()
        self._server.stop()

    def come_back(self) -> None:
        self._start()
        self._frozen.clear()

    def stand_still(self, seconds: float) -> None:
        self.wire.is_open.clear()
        time.sleep(seconds)
        self.wire.is_open.set()
        self._frozen.clear()

    def reload(self) -> None:
        """Unload the Skiller and load it again; a reader keeps its interface open."""
        self.skiller.close()
        self._load()
        self._frozen.clear()

    def controller(self) -> str:
        self.watch.read()
        return str(self.watch.exclusive_controller)

    def close(self) -> None:
        self._done.set()
        self._thread.join(WAIT_S)
        self.wire.close()
        with suppress(Exception):  # perhaps it was killed
            self.skiller.close()
        self._server.stop()
        self.board.shutdown()


@contextmanager
def through_a_gateway(folder: Path, url: str) -> Iterator[str]:
    """Yield the URL of another blackboard, to which a gateway mirrors the Skiller at ``url``."""
    stop: Future[Callable[[], None]] = Future()
    with ExitStack() as stack:
        board = stack.enter_context(LocalBlackBoard(InterfaceRegistry(), RealClock()))
        server = stack.enter_context(ZmqBlackBoardServer(board, [f"ipc://{folder}/middle"]))
        here = server.endpoints[0]
        thread = threading.Thread(
            target=run_gateway, args=((here, url), ["SkillerInterface"]), kwargs={"on_ready": stop.set_result}
        )
        thread.start()
        stack.callback(thread.join, WAIT_S)
        stack.callback(stop.result(WAIT_S))
        eventually(lambda: any(info.has_writer for info in board.list_all()))
        yield here


class Client(threading.Thread):
    """The agent, as a run or in a daemon.

    :param way: ``run``, ``gateway`` or ``daemon``.
    """

    def __init__(self, way: str, folder: Path, url: str) -> None:
        super().__init__()
        self._way, self._folder, self._url = way, folder, url
        self._scenario = write_scenario(folder / "s", agent=AGENT)
        file = self._scenario / "scenario.yaml"
        text = file.read_text().replace("mini.clp,", "goals/retry.clp, goal-tree.clp, mini.clp,")
        # its actions wait for control, they are not stalled
        file.write_text(text.replace(", execmon/stalled-action.clp", ""))
        self.result: Any = None
        self.lines: list[str] = []
        self.daemon_: Daemon | None = None
        if way == "daemon":
            options = DaemonOptions(
                config=self._scenario,
                settings=(("fawkes/enable", False), ("zmq/endpoints", []), ("skiller", url)),
            )
            self.daemon_ = Daemon(options, lambda line: self.lines.append(line.text))  # type: ignore[attr-defined]

    def run(self) -> None:
        if self.daemon_ is not None:
            self.daemon_.run()
        elif self._way == "gateway":
            with through_a_gateway(self._folder, self._url) as url:
                self.result = self._drive(url)
        else:
            self.result = self._drive(self._url)

    def _drive(self, url: str) -> Any:
        return run_scenario(RunOptions(scenario=self._scenario, skiller=url, clock="real", timeout=WAIT_S))

    def has_logged(self, text: str) -> bool:
        return any(text in line for line in self.lines)

    def close(self) -> None:
        if self.daemon_ is not None:
            self.daemon_.stop()
        self.join(WAIT_S)
        assert not self.is_alive()
