"""The daemon: a run that serves clients until it is stopped; see docs/daemon.md.

Clients and the watchdog call from other threads. Their commands wait for the main loop, which alone may touch
CLIPS and the components; only an interrupt of rules is processed on arrival.
"""

from __future__ import annotations

from collections.abc import Sequence
from threading import get_ident
from typing import TYPE_CHECKING, Any

from msgspec.structs import replace

from cxbridge.clock import MICROSECONDS
from cxbridge.daemon.configuration import make_daemon_base, make_run_options
from cxbridge.daemon.executive_node import ExecutiveNode
from cxbridge.daemon.interfaces import INTERRUPT, DaemonInterfaces
from cxbridge.daemon.options import DaemonOptions
from cxbridge.daemon.requests import DaemonRequests
from cxbridge.daemon.systemd import SystemdNotifier
from cxbridge.daemon.table import DAEMON_COMPONENTS
from cxbridge.errors import BrokenAgentError, CxbridgeError
from cxbridge.events import LogLine, Sink
from cxbridge.interrupt import GOODBYE_S, Interrupt
from cxbridge.mainloop import Hook
from cxbridge.plugins import Row
from cxbridge.rights import Rights
from cxbridge.run.agent import Run
from cxbridge.run.components.manager import (
    ComponentFailedError,
    ComponentManager,
    ComponentStatus,
    ManagedNode,
    State,
)
from cxbridge.run.components.table import COMPONENTS, EXECUTIVE, needed_components
from cxbridge.run.result import FAULT
from cxbridge.run.watchdog import Stall, StallReporter

if TYPE_CHECKING:
    from cxbridge.daemon.operations.operation import OperationContext
    from cxbridge.run.plugin_settings import PluginSettings

COMPONENT = "Daemon"
"""The name of the daemon in log lines."""

_CHECK_INTERVAL_US = MICROSECONDS  # also the interval of the notifications that feed systemd's watchdog


class Daemon(Run):
    """A run that serves clients until it is stopped.

    :param options: the options of the command line.
    :param console: gets the log lines.
    :raises CxbridgeError: if the configuration is invalid.
    """

    waits_for_skiller = False

    def __init__(self, options: DaemonOptions, console: Sink | None = None) -> None:
        base, settings = make_daemon_base(options)
        self.settings = settings
        """The tree ``cxbridge:`` of the configuration."""
        self.has_executive = settings.executive
        if console is not None:
            base.bus.subscribe(console, LogLine)
        self.log = base.bus.logger(COMPONENT)
        self.endpoints: list[str] = []
        """The endpoints of the started servers."""
        self._state = "STARTING"
        self._next_check_us = 0
        self._thread_id = 0  # the thread of :meth:`run`; 0 before it
        self._notifier = SystemdNotifier()
        self.node: ExecutiveNode | None = None
        """The executive for clients; None for a daemon without an executive."""
        super().__init__(make_run_options(options, base.config, settings), base)
        self.stalls = StallReporter(
            self.loop,
            lambda: {} if self.node is None else self.node.environments,
            self.log,
            "'cxbridge daemon interrupt' ends what rules do",
            on_stall=self._report_stall,
        )
        nodes = self.lifecycle.nodes
        self.own_interfaces = DaemonInterfaces(
            self.board, [node.name for node in nodes], self.clock.name, self._process_urgent_message
        )
        self._requests = DaemonRequests(
            self.board,
            self.bus,
            self.node,
            settings.rights,
            self.component_statuses,
            self.change_component,
            self.loop,
        )
        for node in nodes:
            for hook in node.hooks:
                self.loop.add(hook, self.lifecycle.guarded(node, node.step))
        self.loop.add(Hook.PRE_LOOP, self._poll)

    @property
    def operations(self) -> OperationContext:
        """The context of operations: the executive, the components, the rights."""
        return self._requests.context

    def _make_nodes(self) -> None:
        """Make the nodes of all components; each node makes its component when it is configured."""
        nodes = [self._make_node(row) for row in needed_components(self, *DAEMON_COMPONENTS)]
        self.lifecycle = ComponentManager(
            nodes, self.clock, self.log, policy=self.settings.on_failure, on_change=self._publish
        )

    def _make_node(self, row: Row) -> ManagedNode[Any]:
        component_class = COMPONENTS.load_target(row)
        if row.name != EXECUTIVE:
            return ManagedNode(row.name, lambda: component_class(self), component_class)
        self.node = self.thinking_node = ExecutiveNode(
            row.name, lambda: component_class(self), component_class, self
        )
        return self.node

    @property
    def has_clients(self) -> bool:
        """Whether clients may send requests; always True."""
        return True

    @property
    def watch_level(self) -> str:
        return self.options.trace_level

    @property
    def rights(self) -> Rights:
        """The rights of clients."""
        return self.settings.rights

    def section(self, name: str) -> PluginSettings | None:
        """Return the settings of a plug-in, None if they are missing."""
        return self.settings.sections.get(name)

    def add_endpoints(self, endpoints: Sequence[str], purpose: str = "the blackboard") -> None:
        """Announce the endpoints of a server."""
        for endpoint in endpoints:
            self.log.info(f"Serving {purpose} at {endpoint}")
        self.endpoints += endpoints
        self.own_interfaces.set_field("endpoints", " ".join(self.endpoints))

    def run(self) -> int:
        """Start the components, work until a signal, a command or a failure, and stop.

        :returns: the exit status: 0 after a requested stop, 4 after a failure.
        :raises CxbridgeError: if a component fails to start and the policy is to stop, or a file that is
            loaded later has mistakes.
        :raises OSError: if a component fails to start because of a file, and the policy is to stop.
        """
        self._thread_id = get_ident()
        for warning in self.warnings:
            self.bus.logger("Config").warn(warning)
        with Interrupt(self.stop, self._interrupt_rules, is_service=True) as interrupt:
            self.stalls.watchdog.start()
            try:
                with self.loop.busy_section():
                    self.lifecycle.startup(interrupt)
                if interrupt.is_signalled:
                    # an interrupted start may have failed only because of the interrupt
                    self.lifecycle.failure = ""
                elif self.lifecycle.failure:
                    raise self._make_startup_error(self.lifecycle.first_error)
                else:
                    self._run_loop()
            finally:
                interrupt.give_time(GOODBYE_S)  # for the finalization rules
                with self.loop.busy_section():
                    self._shut_down()
                self.stalls.watchdog.stop()
                self.clock.close()
        if isinstance(self.lifecycle.first_error, BrokenAgentError):
            raise self.lifecycle.first_error  # a mistake in a file that was loaded after the start
        return FAULT if self.lifecycle.failure else 0

    def _make_startup_error(self, error: Exception) -> Exception:
        """Return a mistake of the user unchanged, and any other error with the name of the component."""
        if isinstance(error, CxbridgeError) or (isinstance(error, OSError) and error.filename is not None):
            return error
        component_error = ComponentFailedError(self.lifecycle.failure)
        component_error.__cause__ = error  # as `raise component_error from error` does
        return component_error

    def _run_loop(self) -> None:
        """Report readiness and run the main loop."""
        self.update_state()
        self._notifier.report_ready(f"serving at {', '.join(self.endpoints) or 'nowhere'}")
        self.log.info("Ready")
        self.loop.run(lambda: bool(self.lifecycle.failure))

    def stop(self) -> None:
        """Make :meth:`run` return soon; callable from any thread."""
        self.loop.stop()

    def _interrupt_rules(self) -> None:
        """Interrupt rules that do not end; callable from any thread."""
        if self.node is not None and self._state == "STOPPING":
            # no cycle follows, so no rule may start either
            self.node.interrupt()
        elif self.node is not None:
            self.node.abort_rule()

    def _shut_down(self) -> None:
        self.stop()
        self._notifier.report_stopping()
        self.log.info("Stopping")
        self._state = "STOPPING"
        self._publish()
        self.lifecycle.shutdown()
        self.log.info("Stopped")

    def _process_urgent_message(self, message_type: str) -> None:
        """Interrupt rules on the arrival of a command: on request, or if the stuck loop cannot process it."""
        if message_type == INTERRUPT:
            self.stalls.interrupt()
        # the rules that a client resumes are stopped at a breakpoint, not stuck
        elif message_type != "ResumeMessage" and self.stalls.current is not None:
            self.stalls.watchdog.interrupt()

    def _report_stall(self, stall: Stall | None) -> None:
        """Report the start or end of a stuck cycle; called in the watchdog's thread."""
        if stall is None:
            self.log.info("The loop continues")
        elif self.loop.is_stopping:
            self.stalls.watchdog.interrupt()  # the servers are stopping, so no client can interrupt the rules
        self._notifier.report_status("the loop continues" if stall is None else str(stall))
        self._publish()

    def _poll(self) -> None:
        """Process commands, and check the components once a second."""
        while (command := self.own_interfaces.next_command()) is not None:
            self._process_command(*command)
        self._requests.process_next()
        now_us = self.clock.now_us()
        if now_us >= self._next_check_us:
            self._next_check_us = now_us + _CHECK_INTERVAL_US
            self.lifecycle.check_active()
            self._notifier.report_alive()
            self.update_state()

    def _process_command(self, verb: str, msgid: int) -> None:
        """Process a command; servers have refused commands of clients without the right to control."""
        # states published while the command is processed must not count as its reply
        self.own_interfaces.acknowledge(0)
        self.carry_out(verb)
        self.own_interfaces.acknowledge(msgid)
        self.update_state()

    def carry_out(self, verb: str) -> None:
        """Process a command of a client, between two steps of the main loop.

        CLIPS allows a single thread; other threads use :func:`cxbridge.daemon.client.send_command`.

        :raises RuntimeError: in another thread than that of :meth:`run`.
        """
        if get_ident() != self._thread_id:
            raise RuntimeError("a daemon's commands are carried out by its main loop: send it a message")
        if verb == "interrupt":
            return  # processed on arrival
        self.log.info(f"A client asks to {verb}")
        if verb == "shutdown":
            self.stop()
        elif verb:  # pause, resume or reset; empty for an unknown message
            getattr(self.lifecycle, verb)()
        if verb == "resume":
            self._requests.resume()
        self.update_state()

    @property
    def state(self) -> str:
        """The name of the daemon's ``DaemonState``."""
        return "DEGRADED" if self.stalls.text and self._state == "RUNNING" else self._state

    def component_statuses(self) -> list[ComponentStatus]:
        """Return the states of the components; of a component with a stuck rule, the reason is the stall."""
        stall = self.stalls.current
        return [
            replace(status, reason=str(stall))
            if stall is not None and status.name == stall.component
            else status
            for status in self.lifecycle.status()
        ]

    def change_component(self, name: str, transition: str) -> None:
        """Change the state of a component by a transition of its lifecycle, in the thread of the main loop.

        :raises LifecycleError: if the state of the component does not allow the transition, or it fails.
        """
        try:
            self.lifecycle.change_component(name, transition)
        finally:
            self.update_state()

    def update_state(self) -> None:
        """Compute and publish the state of the daemon."""
        is_running = all(node.state is State.ACTIVE for node in self.lifecycle.nodes)
        self._state = "PAUSED" if self.lifecycle.paused else ("RUNNING" if is_running else "DEGRADED")
        self._publish()

    def _publish(self) -> None:
        components = self.component_statuses()
        errors = (f"{status.name}: {status.reason}" for status in components if status.reason)
        # a paused component has a reason, which is no error
        self.own_interfaces.set_field(
            "error", "" if self._state == "PAUSED" else next(errors, self.stalls.text)
        )
        self.own_interfaces.publish(self.state, components)
