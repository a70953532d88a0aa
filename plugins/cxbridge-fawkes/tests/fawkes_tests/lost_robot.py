"""A robot that a test stops and restarts, and a run or a daemon that drives the robot."""

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
"""Timeout of a test in seconds."""

TIMEOUT_S = 0.6
"""Timeout of a client's request in seconds."""

SKILL_S = 0.9
"""Duration of the robot's skill in seconds."""

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
"""An agent with a skill and at most three tries, which acquires control sooner than the core does."""


class Relay(threading.Thread):
    """Forwards bytes between clients and the robot; a closed relay simulates a stopped process."""

    def __init__(self, robot_port: int) -> None:
        super().__init__(daemon=True)
        self._robot_port = robot_port
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
            robot = socket.create_connection(("127.0.0.1", self._robot_port))
        except OSError:
            client.close()
            return
        for source, sink in ((client, robot), (robot, client)):
            threading.Thread(target=self._forward, args=(source, sink), daemon=True).start()

    def _forward(self, source: socket.socket, sink: socket.socket) -> None:
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
    """A blackboard with a Skiller, which halts when a client's skill string reaches a state.

    :param state: ``acquiring`` control, or the skill string is ``sent``, ``running`` or ``ended``.
    """

    def __init__(self, state: str) -> None:
        self._state = state
        self.reached = threading.Event()
        self._done = threading.Event()
        self._frozen = threading.Event()
        self._port = 0
        self.tries = 0
        self._start()
        self.relay = Relay(self._port)
        self.url = f"fawkes://127.0.0.1:{self.relay.port}"
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
                with suppress(Exception):  # kill() may interrupt the loop
                    self._loop()

    def _loop(self) -> None:
        waiting = [message.type for message in self.skiller._interface.msgq_iter()]
        halting_messages = {"acquiring": "AcquireControlMessage", "sent": "ExecSkillMessage"}
        if not self.reached.is_set() and halting_messages.get(self._state) in waiting:
            self.halt()
            return
        self.skiller.loop()
        self.tries += waiting.count("ExecSkillMessage")
        shown = self.skiller._interface.status.name
        if (
            not self.reached.is_set()
            and {"S_RUNNING": "running", "S_FINAL": "ended"}.get(shown) == self._state
        ):
            self.halt()

    def halt(self) -> None:
        """Stop the Skiller until the test disturbs the robot."""
        self._frozen.set()
        self.reached.set()

    # -- disturbances

    def kill(self) -> None:
        """End without a last write, as after SIGKILL."""
        self._frozen.set()
        self.board.shutdown()
        self._server.stop()

    def restart(self) -> None:
        self._start()
        self._frozen.clear()

    def stall(self, seconds: float) -> None:
        self.relay.is_open.clear()
        time.sleep(seconds)
        self.relay.is_open.set()
        self._frozen.clear()

    def reload(self) -> None:
        """Unload and load the Skiller; a reader keeps the interface open."""
        self.skiller.close()
        self._load()
        self._frozen.clear()

    def controller(self) -> str:
        self.watch.read()
        return str(self.watch.exclusive_controller)

    def close(self) -> None:
        self._done.set()
        self._thread.join(WAIT_S)
        self.relay.close()
        with suppress(Exception):  # the board is gone after kill()
            self.skiller.close()
        self._server.stop()
        self.board.shutdown()


@contextmanager
def serve_through_gateway(folder: Path, url: str) -> Iterator[str]:
    """Yield the URL of a second blackboard, to which a gateway mirrors the Skiller at ``url``."""
    stop: Future[Callable[[], None]] = Future()
    with ExitStack() as stack:
        board = stack.enter_context(LocalBlackBoard(InterfaceRegistry(), RealClock()))
        server = stack.enter_context(ZmqBlackBoardServer(board, [f"ipc://{folder}/middle"]))
        endpoint = server.endpoints[0]
        thread = threading.Thread(
            target=run_gateway,
            args=((endpoint, url), ["SkillerInterface"]),
            kwargs={"on_ready": stop.set_result},
        )
        thread.start()
        stack.callback(thread.join, WAIT_S)
        stack.callback(stop.result(WAIT_S))
        eventually(lambda: any(info.has_writer for info in board.list_all()))
        yield endpoint


class Client(threading.Thread):
    """The agent in a run or a daemon.

    :param kind: ``run``, ``gateway`` or ``daemon``.
    """

    def __init__(self, kind: str, folder: Path, url: str) -> None:
        super().__init__()
        self._kind, self._folder, self._url = kind, folder, url
        self._scenario = write_scenario(folder / "s", agent=AGENT)
        file = self._scenario / "scenario.yaml"
        text = file.read_text().replace("mini.clp,", "goals/retry.clp, goal-tree.clp, mini.clp,")
        # an action that waits for control is not stalled
        file.write_text(text.replace(", execmon/stalled-action.clp", ""))
        self.result: Any = None
        self.lines: list[str] = []
        self.daemon_: Daemon | None = None
        if kind == "daemon":
            options = DaemonOptions(
                config=self._scenario,
                settings=(("fawkes/enable", False), ("zmq/endpoints", []), ("skiller", url)),
            )
            self.daemon_ = Daemon(options, lambda line: self.lines.append(line.text))  # type: ignore[attr-defined]

    def run(self) -> None:
        if self.daemon_ is not None:
            self.daemon_.run()
        elif self._kind == "gateway":
            with serve_through_gateway(self._folder, self._url) as url:
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
