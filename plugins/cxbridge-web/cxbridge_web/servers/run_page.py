"""The web page of a single run: ``cxbridge run --web``."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from cxbridge.daemon.operations.operation import OperationContext
from cxbridge.errors import CxbridgeError
from cxbridge.mainloop import Hook
from cxbridge.run.servers import ATTEND_PAUSE_S, RunServer
from cxbridge_web.host import WebHost
from cxbridge_web.web_server import WebServer

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.rights import Rights
    from cxbridge.run.agent import Run
    from cxbridge.run.result import RunResult
    from cxbridge.run.team import Team
    from cxbridge_web.settings import WebSettings


class RunHost(WebHost):
    """A run as the data source of its web server; see :class:`cxbridge_web.host.WebHost`.

    With several agents, the page has the environments of all agents, but only the blackboard and the
    breakpoints of the first agent.
    """

    def __init__(self, run: Run | Team) -> None:
        super().__init__(run)
        self._agent = run.agents[0]
        self.is_paused = False
        self._result: dict[str, Any] | None = None
        self._end_us = 0
        self.operations = OperationContext(
            self.rights, lambda: self.executive, component_rows=self._list_component_rows
        )

    @property
    def board(self) -> BlackBoard:
        return self._agent.board

    @property
    def rights(self) -> Rights:
        return self._agent.rights

    @property
    def executive(self) -> Executive:
        return self._agent.executive

    def environments(self) -> Mapping[str, ClipsEnvironment]:
        managers = [agent.manager for agent in self._run.agents]
        return {name: env for manager in managers for name, env in manager.environments.items()}

    def _list_component_rows(self) -> list[dict[str, Any]]:
        state = "ACTIVE" if self._result is None else "INACTIVE"
        return [
            {
                "name": agent.name or "executive",
                "state": state,
                "since_us": self._start_us,
                "reason": "",
            }
            for agent in self._run.agents
        ]

    def finish(self, result: RunResult) -> None:
        """Record the result of the run. From then on, clients see the time of the end."""
        self._end_us = self._run.clock.now_us()
        self._result = {"status": result.status, "word": result.word, "reason": result.reason}

    def status(self) -> dict[str, Any]:
        """Return the status of the run; ``FINISHED`` with the result after its end."""
        is_over = self._result is not None
        state = "FINISHED" if is_over else "PAUSED" if self.is_paused else "RUNNING"
        status = self._make_status(
            state, self._list_component_rows(), now_us=self._end_us if is_over else None
        )
        return status | ({"result": self._result} if is_over else {})

    def run_command(self, verb: str) -> None:
        """Pause or resume the run.

        :raises CxbridgeError: for ``reset``, since a run cannot restart.
        """
        if verb == "pause":
            self.is_paused = True
        elif verb == "resume":
            self.is_paused = False
            if (control := self.executive.control) is not None:
                control.go_on()  # a stop at a breakpoint is a pause, too
        else:
            raise CxbridgeError("a run cannot be reset", hint="use a daemon: 'cxbridge daemon start --web'")

    @property
    def stall_reason(self) -> str:
        """Always empty: a run with a page has no watchdog of its loops."""
        return ""

    def interrupt(self) -> None:
        # Clients do not know which agent hangs, so the rules of all agents are interrupted.
        for agent in self._run.agents:
            agent.executive.env.abort_rule()

    def list_components(self) -> Sequence[tuple[str, str, bool]]:
        return ()

    def set_component_active(self, name: str, *, is_active: bool) -> None:
        """Reject the request.

        :raises CxbridgeError: always.
        """
        state = "loaded" if is_active else "unloaded"  # the words of Fawkes' API
        raise CxbridgeError(f"{name} cannot be {state}: the components of a run are fixed")

    def attend(self) -> None:
        """Serve the environments of clients and the blackboard between two loops."""
        self._agent.manager.run_client_environments()
        self._agent.attend()


class RunPage(RunServer):
    """Serves the page of a run.

    :param on_ready: called with the page's address.
    """

    lingering_name = "the page"

    def __init__(self, settings: WebSettings, on_ready: Callable[[str], None]) -> None:
        self._settings = settings
        self._on_ready = on_ready
        self._host: RunHost | None = None
        self._server: WebServer | None = None

    @contextmanager
    def serve(self, run: Run | Team) -> Iterator[None]:
        host = self._host = RunHost(run)
        server = self._server = WebServer(host, self._settings)
        try:
            server.start()
            self._on_ready(server.url)

            def attend_until_resumed() -> None:
                self.attend()
                # A paused run stays between two loops, where the page still gets answers.
                while host.is_paused and not run.loop.is_stopping:
                    time.sleep(ATTEND_PAUSE_S)
                    self.attend()

            run.loop.add(Hook.PRE_LOOP, attend_until_resumed)
            yield
        finally:
            server.stop()

    def attend(self) -> None:
        if self._server is not None and self._host is not None:
            self._server.serve_main_loop()
            self._host.attend()

    def finish(self, result: RunResult) -> None:
        """Show the end of the run on the page."""
        if self._host is not None:
            self._host.finish(result)
