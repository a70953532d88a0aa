"""Blackboard, transports, Skiller and executive as one long-lived process; see docs/daemon.md."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, cast

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.clock import MICROSECONDS, make_clock
from cxbridge.daemon.board import DaemonBoard
from cxbridge.daemon.components import DaemonComponents
from cxbridge.daemon.lifecycle import (
    ComponentFailedError,
    ComponentStatus,
    LifecycleManager,
    ManagedNode,
    State,
)
from cxbridge.daemon.nodes import (
    ExecutiveNode,
    HeldNode,
    LoopNode,
    PartNode,
    RecorderNode,
    Server,
    ServerNode,
    WebNode,
)
from cxbridge.daemon.options import DaemonOptions, make_run_options, read_configuration
from cxbridge.daemon.settings import DaemonSettings
from cxbridge.daemon.stalls import DaemonStalls
from cxbridge.errors import CxbridgeError
from cxbridge.events import EventBus, LogLine, Sink
from cxbridge.executive.robmem.memory import RobotMemory
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.mainloop import Hook, MainLoop
from cxbridge.process.blackboard_urls import open_board
from cxbridge.process.file_limit import WEB_SHARE, ZMQ_SHARE, most_clients, raise_file_limit, share
from cxbridge.process.interrupt import GOODBYE_S, Interrupt
from cxbridge.process.systemd import Notifier
from cxbridge.rights import Right
from cxbridge.run.options import RunOptions
from cxbridge.run.parts import (
    PlanningPart,
    SkillBoardPart,
    Surroundings,
    make_speech,
    needs_planning,
    skill_board_settings,
)
from cxbridge.run.paths import Places, check_places, find_places
from cxbridge.run.recording import start_recording
from cxbridge.run.remote_skiller import RemoteSkiller, is_url
from cxbridge.run.result import FAULT
from cxbridge.run.skillers import make_skillers, skiller_settings
from cxbridge.run.specs import check_spec, choose_spec
from cxbridge.run.think_rate import main_period_us, make_refresh

if TYPE_CHECKING:
    from cxbridge.blackboard.fawkesnet.server import FawkesServer
    from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
    from cxbridge.daemon.explain import DaemonExplainer
    from cxbridge.daemon.plugins import DaemonPlugins
    from cxbridge.daemon.requests import DaemonRequests
    from cxbridge.trace.recorder import Recorder
    from cxbridge.trace.sourcing import EarlySources
    from cxbridge.trace.switch import RecordingSwitch
    from cxbridge.web.server import WebServer

COMPONENT = "Daemon"
"""Under which the daemon logs."""

_WATCH_US = MICROSECONDS


class Daemon:
    """A daemon: made from its options, started and stopped by :meth:`run`.

    :param options: what it was told.
    :param console: gets the log lines.
    :raises CxbridgeError: when the configuration is wrong.
    """

    def __init__(self, options: DaemonOptions, console: Sink | None = None) -> None:
        self.config, config_file = read_configuration(options)
        self.settings = DaemonSettings.of(self.config)
        self.clock = make_clock(self.settings.clock)
        self.bus = EventBus(self.clock)
        self.early: EarlySources | None = None
        if console is not None:
            self.bus.subscribe(console, LogLine)
        self.log = self.bus.logger(COMPONENT)
        self.spec = choose_spec(self.config, options.spec) if self.settings.executive else ""
        run_options = make_run_options(options, self.config, self.settings)
        self._warnings = [*map(str, self.config.warnings)]
        if self.spec:
            self._warnings += check_spec(self.config, self.spec)
        self.places: Places = find_places(run_options, self.config, config_file)
        if self.spec:
            self._warnings += check_places(self.config, self.spec, self.places)
        self.registry = InterfaceRegistry(self.places.interface_dirs)
        self.board = LocalBlackBoard(self.registry, self.clock, self.bus)
        self.memory = RobotMemory(self.config, self.clock, self.bus, self.board)
        self.around = Surroundings(
            self.config,
            self.clock,
            self.bus,
            self.board,
            self.places,
            self.memory,
            refresh=make_refresh(self.config, self.clock, self.places),
        )
        self.loop = MainLoop(self.clock, main_period_us(self.config, ros2cx=options.ros2cx is not None))
        self.loop.add(Hook.WORLDSTATE, self.memory.attend)
        self.endpoints: list[str] = []
        """Where it can be reached, as far as its servers are up."""
        self._state = "STARTING"
        self._next_watch_us = 0
        self._notifier = Notifier()
        self._executive: ExecutiveNode | None = None
        self.manager = LifecycleManager(
            self._nodes(run_options),
            self.clock,
            self.log,
            policy=self.settings.on_failure,
            on_change=self._publish,
        )
        names = [node.name for node in self.manager.nodes]
        self.plugins: DaemonPlugins | None = None
        self.stalls = DaemonStalls(
            self.loop,
            lambda: {} if self._executive is None else self._executive.environments,
            self.log,
            self._notifier,
            self._publish,
            allowed=self.settings.rights.control,
            limit_s=self.settings.watchdog_s,
        )
        self.status = DaemonBoard(self.board, names, self.clock.name, self.stalls.heard)
        self.parts = DaemonComponents(self.manager, self.components, self._settle)
        self._explainer = self._make_explainer()
        self._requests = self._make_requests()
        for node in self.manager.nodes:
            if isinstance(node, WebNode):
                self.loop.add(Hook.PRE_LOOP, self.manager.guarded(node, node.attend))
            if isinstance(node, LoopNode):
                for hook in node.hooks:
                    self.loop.add(hook, self.manager.guarded(node, node.step))
        self.loop.add(Hook.PRE_LOOP, self._attend)

    def _shut_board(self) -> None:
        """Close what everybody works with: the last to go."""
        self.memory.close()
        self.board.shutdown()

    # -- components

    def _nodes(self, run_options: RunOptions) -> list[ManagedNode]:
        """Make the components, in the order of their start."""
        settings, board = self.settings, skill_board_settings(self.config, self.places)
        nodes: list[ManagedNode] = [HeldNode("blackboard", lambda: self._shut_board)]
        if settings.trace or settings.log or settings.bblog:
            nodes.append(
                RecorderNode(lambda: start_recording(self, run_options, keep=True), self._make_switch)
            )
        if settings.endpoints:
            nodes.append(ServerNode("zmq", self._make_zmq, self._zmq_started))
        if settings.fawkes:
            nodes.append(ServerNode("fawkes", self._make_fawkes, self._fawkes_started))
        if settings.web is not None:
            nodes.append(WebNode(self._make_web, self._web_started))
        if is_url(settings.skiller):
            nodes.append(PartNode("skiller", self._make_remote_skiller, []))
        elif settings.skiller != "none" and (
            skillers := skiller_settings(self.config, settings.skiller, board.skillers if board else ())
        ):
            if any(item.kind == "lua" for item in skillers):
                speech: Callable[[], Any] = lambda: make_speech(self.around, settings.speech)  # noqa: E731
                nodes.append(PartNode("speech", speech, [Hook.ACT]))
            skiller: Callable[[], Any] = lambda: make_skillers(self.around, skillers)  # noqa: E731
            nodes.append(PartNode("skiller", skiller, [Hook.SKILL]))
        if board is not None:
            make = partial(SkillBoardPart, self.around, board, run_options.executors)
            nodes.append(PartNode("skill-board", make, [Hook.SKILL]))
        return [*nodes, *self._executive_nodes()] if settings.executive else nodes

    def _executive_nodes(self) -> Iterator[ManagedNode]:
        """Make the executive, and before it what its spec waits for."""
        if needs_planning(self.config, self.spec):
            yield PartNode("planning", lambda: PlanningPart(self.around, self.spec), [Hook.ACT_EXEC])
        self._executive = ExecutiveNode(self.around, self.spec, self.settings.trace_level)
        yield self._executive

    def _make_switch(self, recorder: Recorder) -> RecordingSwitch | None:
        """Let ``ffbblog enable`` and ``disable`` switch what Fawkes' bblogger would write."""
        if self.settings.bblog is None or not self.settings.rights.control:
            return None
        from cxbridge.trace.formats.bblogger.writer import BBLoggerWriter  # noqa: PLC0415 - see _make_zmq
        from cxbridge.trace.switch import RecordingSwitch  # noqa: PLC0415

        return RecordingSwitch(
            self.board, lambda enabled: recorder.enable(enabled, BBLoggerWriter), self.bus.logger("BBLogger")
        )

    def _make_explainer(self) -> DaemonExplainer | None:
        """Make what tells why rules have not fired, if there shall be rules."""
        node = self._executive
        if node is None:
            return None
        from cxbridge.daemon.explain import DaemonExplainer  # noqa: PLC0415 - see _make_zmq

        where = f"{self.spec} in the daemon"
        settings = self.settings
        recorded = settings.trace is not None and settings.trace_level != "transitions"
        return DaemonExplainer(
            self.board,
            self.bus,
            lambda: node.env,
            where,
            self.places.clips_dirs,
            with_firings=recorded or settings.log is not None,
        )

    def _make_requests(self) -> DaemonRequests:
        """Make what takes requests to the executive and the components."""
        from cxbridge.daemon.requests import DaemonRequests  # noqa: PLC0415 - see _make_zmq

        return DaemonRequests(self.board, self.bus, self._executive, self.settings.rights, self.parts)

    def _make_zmq(self) -> Server:
        # transports for those who use them: start-up time is a feature
        from cxbridge.blackboard.zmq.security import CurveServer  # noqa: PLC0415
        from cxbridge.blackboard.zmq.server import MOST_CONNECTIONS, ZmqBlackBoardServer  # noqa: PLC0415

        settings, keys = self.settings, None
        if settings.secret_key is not None and settings.clients is not None:
            keys = CurveServer(settings.secret_key, settings.clients)
        return ZmqBlackBoardServer(
            self.board,
            list(settings.endpoints),
            keys=keys,
            insecure=settings.insecure,
            rights=settings.rights,
            most_connections=share(raise_file_limit(), MOST_CONNECTIONS, ZMQ_SHARE),
        )

    def _zmq_started(self, server: Server) -> None:
        self._serving(cast("ZmqBlackBoardServer", server).endpoints)

    def _make_fawkes(self) -> Server:
        from cxbridge.blackboard.fawkesnet.components.configuration import (  # noqa: PLC0415
            ConfigurationComponent,
        )
        from cxbridge.blackboard.fawkesnet.components.logger import NetworkLogger  # noqa: PLC0415
        from cxbridge.blackboard.fawkesnet.components.plugins import PluginManager  # noqa: PLC0415
        from cxbridge.blackboard.fawkesnet.server import DEFAULT_LIMITS, FawkesServer  # noqa: PLC0415
        from cxbridge.daemon.plugins import DaemonPlugins  # noqa: PLC0415

        settings, rights = self.settings.fawkes, self.settings.rights
        assert settings is not None  # else there is no such node
        self.plugins = DaemonPlugins(self.manager, allowed=rights.allow(Right.CONTROL))
        manager = self.plugins.watchers = PluginManager(self.plugins, self.log.warn)
        components = (
            manager,
            ConfigurationComponent(self.config, writable=rights.allow(Right.PROGRAMS)),
            NetworkLogger(self.bus),
        )
        return FawkesServer(
            self.board,
            settings.host,
            settings.port,
            bus=self.bus,
            components=components,
            allow=settings.allow,
            rights=rights,
            limits=replace(
                DEFAULT_LIMITS, most_clients=most_clients(raise_file_limit(), DEFAULT_LIMITS.most_clients)
            ),
        )

    def _fawkes_started(self, server: Server) -> None:
        fawkes = cast("FawkesServer", server)
        host = f"[{fawkes.host}]" if ":" in fawkes.host else fawkes.host
        self._serving([f"fawkes://{host}:{fawkes.port}"])

    def _make_web(self) -> WebServer:
        from cxbridge.daemon.web import DaemonWeb  # noqa: PLC0415
        from cxbridge.web.connections import MOST_SOCKETS  # noqa: PLC0415
        from cxbridge.web.server import WebServer  # noqa: PLC0415

        settings = self.settings.web
        assert settings is not None  # else there is no such node
        most = share(raise_file_limit(), MOST_SOCKETS, WEB_SHARE)
        web = DaemonWeb(self, self._carry_out, self._executive, self._requests.context)
        return WebServer(web, settings, most)

    def _web_started(self, server: WebServer) -> None:
        self.log.info(f"Serving the web page and the REST API at {server.url}")
        self.endpoints.append(server.url)
        self.status.tell(endpoints=self.endpoints)

    def _serving(self, endpoints: list[str]) -> None:
        for endpoint in endpoints:
            self.log.info(f"Serving the blackboard at {endpoint}")
        self.endpoints += endpoints
        self.status.tell(endpoints=self.endpoints)

    def _make_remote_skiller(self) -> RemoteSkiller:
        # it may come later: a daemon has patience
        return RemoteSkiller(self.settings.skiller, self.board, self.bus, self._open_board, patience_s=0)

    def _open_board(self, url: str) -> BlackBoard:
        return open_board(url, self.registry, self.clock, self.bus)

    # -- life

    def run(self, *, on_ready: Callable[[], None] = lambda: None) -> int:
        """Start, work until SIGINT, SIGTERM, a command or a failure, and stop; return the exit status.

        :param on_ready: called when everything is started.
        :returns: 0 after a stop that was asked for, 4 after a failure.
        :raises CxbridgeError: when a component cannot be started and the policy is to stop.
        """
        for warning in self._warnings:
            self.bus.logger("Config").warn(warning)
        with Interrupt(self.stop, self._force, service=True) as interrupt:
            self.stalls.watchdog.start()
            try:
                with self.loop.busy():
                    self.manager.startup(interrupt)
                if interrupt.received:
                    # what was broken off may have failed for that reason only
                    self.manager.failure = ""
                elif self.manager.failure:
                    raise self._foreseen(self.manager.failure_error)
                else:
                    self._work(on_ready)
            finally:
                interrupt.give_time(GOODBYE_S)
                with self.loop.busy():
                    self._wind_up()
                self.stalls.watchdog.stop()
        return FAULT if self.manager.failure else 0

    def _foreseen(self, error: Exception) -> Exception:
        """Return an error of the user's as it is, and of any other one that says which component failed."""
        if isinstance(error, CxbridgeError) or (isinstance(error, OSError) and error.filename is not None):
            return error
        failed = ComponentFailedError(self.manager.failure)
        failed.__cause__ = error
        return failed

    def _work(self, on_ready: Callable[[], None]) -> None:
        self._settle()
        self._notifier.ready(f"serving at {', '.join(self.endpoints) or 'nowhere'}")
        self.log.info("Ready")
        on_ready()
        self.loop.run(lambda: bool(self.manager.failure))

    def stop(self) -> None:
        """Make :meth:`run` return soon; from any thread."""
        self.loop.stop()

    def _force(self) -> None:
        """End what rules do that do not come to their end; from any thread."""
        if self._executive is None:
            return
        if self._state == "STOPPING":
            self._executive.interrupt()
        else:
            self._executive.break_off()

    def _wind_up(self) -> None:
        self.stop()
        self._notifier.stopping()
        self.log.info("Stopping")
        self._state = "STOPPING"
        if self.plugins is not None:
            self.plugins.close()
        if self._explainer is not None:
            self._explainer.close()
        self._publish()
        self.manager.shutdown()
        self.log.info("Stopped")

    # -- every loop

    def _attend(self) -> None:
        """Carry out commands; once a second, see whether all is well."""
        while (command := self.status.next_command()) is not None:
            self._command(*command)
        if self.plugins is not None and self.plugins.attend():
            self._settle()
        if self._explainer is not None:
            self._explainer.attend()
        self._requests.attend()
        now_us = self.clock.now_us()
        if now_us >= self._next_watch_us:
            self._next_watch_us = now_us + _WATCH_US
            self.manager.watch()
            self._notifier.alive()
            self._settle()

    def _command(self, what: str, msgid: int) -> None:
        rights = self.settings.rights
        if not rights.allow(Right.CONTROL):  # the servers have refused it already
            self.log.warn(f"Refusing to {what}: {rights.why_not(Right.CONTROL)}")
            return
        self.status.answer(0)  # what is published on the way is no answer yet
        self._carry_out(what)
        self.status.answer(msgid)
        self._settle()

    def _carry_out(self, what: str) -> None:
        if what == "interrupt":
            return  # it was carried out when it came
        self.log.info(f"A client asks to {what}")
        if what == "shutdown":
            self.stop()
        elif what:
            getattr(self.manager, what)()
        if what == "resume":
            self._requests.resume()
        self._settle()

    @property
    def state(self) -> str:
        """How it stands: name of a ``DaemonState``."""
        return "DEGRADED" if self.stalls.text and self._state == "RUNNING" else self._state

    def components(self) -> list[ComponentStatus]:
        """Return how the components stand."""
        return self.stalls.apply(self.manager.status())

    def _settle(self) -> None:
        """Tell how the daemon stands."""
        states = {status.state for status in self.manager.status()}
        if self.manager.paused:
            self._state = "PAUSED"
        else:
            self._state = "RUNNING" if states <= {State.ACTIVE} else "DEGRADED"
        if self.plugins is not None:
            self.plugins.tell()
        self._publish()

    def _publish(self) -> None:
        components = self.components()
        troubles = [f"{status.name}: {status.reason}" for status in components if status.reason]
        if not troubles and self.stalls.text:
            troubles = [self.stalls.text]
        self.status.tell(error=troubles[0] if troubles and self._state != "PAUSED" else "")
        self.status.publish(self.state, components)
