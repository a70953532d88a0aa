"""The components of a daemon as managed nodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from cxbridge.daemon.lifecycle import ManagedNode
from cxbridge.errors import ExecutiveError
from cxbridge.mainloop import Hook
from cxbridge.run.parts import Component, Surroundings, make_executive, watch_for_recording
from cxbridge.run.think_rate import think

if TYPE_CHECKING:
    from cxbridge.executive.breakpoints import Breakpoint
    from cxbridge.executive.debugger import Debugger
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.goals import GoalState
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.manager import EnvironmentManager
    from cxbridge.executive.service import EnvironmentService
    from cxbridge.trace.recorder import Recorder
    from cxbridge.trace.switch import RecordingSwitch
    from cxbridge.web.server import WebServer


class Server(Protocol):
    """Something that serves the blackboard in a thread of its own."""

    def start(self) -> None:
        """Begin to serve."""

    def stop(self) -> None:
        """Serve no more, and let go of everything."""


class LoopNode(ManagedNode):
    """A component that works at hooks of the main loop.

    :param hooks: where.
    """

    def __init__(self, name: str, hooks: Sequence[Hook], *, steady: bool = False) -> None:
        super().__init__(name, steady=steady)
        self.hooks = tuple(hooks)

    def step(self) -> None:
        """Do the work of a loop."""


class PartNode(LoopNode):
    """A component that is made when it is configured, and closed at its cleanup.

    :param make: makes it; leaves nothing behind when it raises.
    """

    def __init__(self, name: str, make: Callable[[], Component], hooks: Sequence[Hook]) -> None:
        super().__init__(name, hooks)
        self._make = make
        self._part: Component | None = None

    def on_configure(self) -> None:
        """Make it."""
        self._part = self._make()

    def on_cleanup(self) -> None:
        """Close it."""
        part, self._part = self._part, None
        if part is not None:
            part.close()

    def step(self) -> None:
        """Let it work."""
        if self._part is not None:
            self._part.loop()


class ServerNode(ManagedNode):
    """A server, that is made and started when it is activated, and goes on while others are paused.

    :param make: makes it.
    :param started: called with it when it serves.
    """

    def __init__(self, name: str, make: Callable[[], Server], started: Callable[[Server], None]) -> None:
        super().__init__(name, steady=True)
        self._make = make
        self._started = started
        self._server: Server | None = None

    def on_activate(self) -> None:
        """Begin to serve."""
        server = self._make()
        try:
            server.start()
        except Exception:
            server.stop()
            raise
        self._server = server
        self._started(server)

    def on_deactivate(self) -> None:
        """Serve no more."""
        server, self._server = self._server, None
        if server is not None:
            server.stop()


class WebNode(ManagedNode):
    """The web server, whose questions the main loop answers; it goes on while others are paused.

    It hears of what happens from its configuration on: others come to life before it serves.

    :param make: makes it.
    :param started: called with it when it serves.
    """

    def __init__(self, make: Callable[[], WebServer], started: Callable[[WebServer], None]) -> None:
        super().__init__("web", steady=True)
        self._make = make
        self._started = started
        self._server: WebServer | None = None

    def on_configure(self) -> None:
        """Begin to listen to what happens."""
        self._server = self._make()

    def on_activate(self) -> None:
        """Begin to serve."""
        if self._server is not None:
            self._server.start()
            self._started(self._server)

    def on_cleanup(self) -> None:
        """Serve no more."""
        server, self._server = self._server, None
        if server is not None:
            server.stop()

    def attend(self) -> None:
        """Answer questions. Called once a loop."""
        if self._server is not None:
            self._server.attend()


class HeldNode(ManagedNode):
    """Something that others rely on from the first to the last.

    :param begin: makes it be there; returns what ends it.
    """

    def __init__(self, name: str, begin: Callable[[], Callable[[], None]]) -> None:
        super().__init__(name, steady=True)
        self._begin = begin
        self._end: Callable[[], None] = _nothing

    def on_configure(self) -> None:
        """Begin."""
        self._end = self._begin()

    def on_cleanup(self) -> None:
        """End."""
        end, self._end = self._end, _nothing
        end()


def _nothing() -> None:
    pass


class RecorderNode(LoopNode):
    """Records what happens, from before the others begin until after they have ended.

    :param begin: opens the files.
    :param make_switch: puts a switch for it on the blackboard, if there shall be one.
    """

    def __init__(
        self, begin: Callable[[], Recorder], make_switch: Callable[[Recorder], RecordingSwitch | None]
    ) -> None:
        super().__init__("recorder", [Hook.POST_LOOP], steady=True)
        self._begin = begin
        self._make_switch = make_switch
        self._recorder: Recorder | None = None
        self._switch: RecordingSwitch | None = None

    def on_configure(self) -> None:
        """Open the files."""
        self._recorder = self._begin()
        self._switch = self._make_switch(self._recorder)

    def on_cleanup(self) -> None:
        """Finish the files."""
        if self._switch is not None:
            self._switch.close()
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            recorder.close()

    def step(self) -> None:
        """Bring what was recorded into the files, now and then."""
        if self._recorder is not None:
            self._recorder.flush_when_due()

    def check(self) -> None:
        """Raise when something could not be recorded."""
        if self._recorder is not None and self._recorder.errors:
            raise self._recorder.errors[0]


class ExecutiveNode(LoopNode):
    """The CLIPS Executive.

    :param spec: which of the configuration's.
    :param trace_level: how much is recorded of it.
    """

    def __init__(self, around: Surroundings, spec: str, trace_level: str) -> None:
        super().__init__("executive", [Hook.THINK])
        self._around = around
        self._spec = spec
        self._trace_level = trace_level
        self._manager: EnvironmentManager | None = None
        self._executive: Executive | None = None
        self._service: EnvironmentService | None = None
        self._breakpoints: tuple[Breakpoint, ...] = ()

    def on_configure(self) -> None:
        """Load the core and the agent."""
        from cxbridge.executive.service import EnvironmentService  # noqa: PLC0415 - start-up time is a feature

        manager, executive = make_executive(self._around, self._spec)
        self._manager = manager  # what it does from now on may have to be ended
        try:
            executive.env.watcher.start()
            executive.follow_transitions()
            watch_for_recording(executive, self._around.config, self._trace_level)
            for item in self._breakpoints:
                executive.debugger.add(item)
            executive.init()
        except Exception:
            self._manager = None
            executive.close()
            manager.close()
            raise
        if self._around.refresh is not None:
            self._around.refresh.start()
        self._executive = executive
        self._service = EnvironmentService(manager)

    def on_cleanup(self) -> None:
        """Let the rules say good-bye, and unload all."""
        manager, executive = self._manager, self._executive
        self._executive = self._service = None
        if manager is not None and executive is not None:
            self._breakpoints = executive.debugger.breakpoints
            try:
                executive.finalize()
            finally:
                self._manager = None
                executive.close()
                manager.close()

    def step(self) -> None:
        """Think."""
        if self._executive is not None and self._service is not None:
            think(self._executive, self._around.refresh)
            self._service.run()

    def check(self) -> None:
        """Raise when a fault of ours came to light in the rules' work, or the agent has quit."""
        if self._executive is not None:
            self._executive.goals.settle()  # or the goals that ended would be kept for ever
            env = self._executive.env
            if env.faults:
                raise ExecutiveError(env.faults[0])
            if env.quit_requested:
                raise ExecutiveError("the agent has quit")

    @property
    def env(self) -> ClipsEnvironment | None:
        """The environment; None while it is not configured."""
        return None if self._executive is None else self._executive.env

    @property
    def goals(self) -> Mapping[str, GoalState]:
        """The goals whose facts are there, by id; none while it is not configured."""
        return {} if self._executive is None else self._executive.goals.open

    @property
    def debugger(self) -> Debugger | None:
        """The debugger of the executive; None while it is not configured."""
        return None if self._executive is None else self._executive.debugger

    @property
    def service(self) -> EnvironmentService | None:
        """What manages the environments; None while it is not configured."""
        return self._service

    @property
    def environments(self) -> dict[str, ClipsEnvironment]:
        """All environments by name; none while it is not configured."""
        return {} if self._manager is None else self._manager.environments

    def interrupt(self) -> None:
        """End the thinking that is under way, and let no other begin; from any thread."""
        for env in tuple(self.environments.values()):
            env.interrupt()

    def break_off(self) -> None:
        """End the thinking of this loop; from any thread."""
        for env in tuple(self.environments.values()):
            env.break_off()
