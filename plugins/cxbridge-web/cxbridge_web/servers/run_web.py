"""The web page of a single run: ``cxbridge run --web``."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from cxbridge.errors import CxbridgeError
from cxbridge.mainloop import Hook
from cxbridge.operations.operation import OperationContext
from cxbridge.run.servers import REST_S, RunServer
from cxbridge_web.host import WebHost
from cxbridge_web.server import WebServer

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.rights import Rights
    from cxbridge.run.agent import Run
    from cxbridge.run.result import RunResult
    from cxbridge.run.team import Team
    from cxbridge_web.settings import WebSettings


class RunWeb(WebHost):
    """A run as its web server sees it; :class:`cxbridge_web.host.WebHost`.

    Of several agents the page has all environments; blackboard and breakpoints are those of the first one.
    """

    def __init__(self, run: Run | Team) -> None:
        super().__init__(run)
        self._run = run
        self._agent = run.agents[0]
        self.paused = False
        self._result: dict[str, Any] | None = None
        self._end_us = 0
        self.operations = OperationContext(
            self.rights, lambda: self.executive, component_rows=self._components
        )

    @property
    def board(self) -> BlackBoard:
        """The blackboard."""
        return self._agent.board

    @property
    def rights(self) -> Rights:
        """What clients may do."""
        return self._agent.rights

    @property
    def executive(self) -> Executive:
        """The executive."""
        return self._agent.executive

    def environments(self) -> Mapping[str, ClipsEnvironment]:
        """Return the CLIPS environments by name."""
        found: dict[str, ClipsEnvironment] = {}
        for agent in self._run.agents:
            found.update(agent.manager.environments)
        return found

    def _components(self) -> list[dict[str, Any]]:
        state = "ACTIVE" if self._result is None else "INACTIVE"
        return [
            {"name": agent.name or "executive", "state": state, "since_us": self._start_us, "reason": ""}
            for agent in self._run.agents
        ]

    def finish(self, result: RunResult) -> None:
        """Note that the run has come to its end: its clock stands still for clients from now on."""
        self._end_us = self._run.clock.now_us()
        self._result = {"status": result.status, "word": result.word, "reason": result.reason}

    def status(self) -> dict[str, Any]:
        """Return how the run stands; ``FINISHED`` when it has come to its end, and with which result."""
        over = self._result is not None
        state = "FINISHED" if over else "PAUSED" if self.paused else "RUNNING"
        status = self._status(state, self._components(), now_us=self._end_us if over else None)
        return status | ({"result": self._result} if over else {})

    def command(self, verb: str) -> None:
        """Pause or resume the run.

        :raises CxbridgeError: for ``reset``: a run is not begun again.
        """
        if verb == "pause":
            self.paused = True
        elif verb == "resume":
            self.paused = False
            if (control := self.executive.control) is not None:
                control.go_on()
        else:
            raise CxbridgeError("a run cannot be reset", hint="a daemon can: 'cxbridge daemon start --web'")

    @property
    def stall(self) -> str:
        """Nothing: the loops of a run with a page have no watcher."""
        return ""

    def interrupt(self) -> None:
        """End what rules do in this loop, from any thread."""
        for agent in self._run.agents:
            agent.executive.env.break_off()

    def plugins(self) -> Sequence[tuple[str, str, bool]]:
        """Return nothing: a run has no plugins."""
        return ()

    def load_plugin(self, name: str, *, load: bool) -> None:
        """Refuse it.

        :raises CxbridgeError: always.
        """
        state = "loaded" if load else "unloaded"
        raise CxbridgeError(f"{name} cannot be {state}: a run has the same parts from its start to its end")

    def attend(self) -> None:
        """Answer requests between two loops."""
        self._agent.manager.run_extra()
        self._agent.attend()


class RunPage(RunServer):
    """Serves the page of a run.

    :param on_ready: gets the page's address, once it is served.
    """

    stays = "the page"

    def __init__(self, settings: WebSettings, on_ready: Callable[[str], None]) -> None:
        self._settings = settings
        self._on_ready = on_ready
        self._host: RunWeb | None = None
        self._server: WebServer | None = None

    @contextmanager
    def serve(self, run: Run | Team) -> Iterator[None]:
        """Serve a run's page."""
        host = self._host = RunWeb(run)
        server = self._server = WebServer(host, self._settings)
        try:
            server.start()
            self._on_ready(server.url)

            def attend() -> None:
                self.attend()
                while host.paused and not run.loop.stopping:
                    time.sleep(REST_S)
                    self.attend()

            run.loop.add(Hook.PRE_LOOP, attend)
            yield
        finally:
            server.stop()

    def attend(self) -> None:
        """Answer requests."""
        if self._server is not None and self._host is not None:
            self._server.attend()
            self._host.attend()

    def finish(self, result: RunResult) -> None:
        """Let the page say how the run has ended."""
        if self._host is not None:
            self._host.finish(result)
