"""The component that makes a daemon a managed node of ROS 2.

The log of the daemon is on /rosout, its state on /diagnostics, and clients pause, resume and stop the daemon
with the services of managed nodes (lifecycle_msgs).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.daemon.daemon import Daemon
from cxbridge.errors import ConfigError
from cxbridge.events import Level
from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge.run.components.manager import ComponentStatus, State
from cxbridge_ros2.lifecycle import ACTIVATE, CLEANUP, DEACTIVATE, SHUTDOWN, Lifecycle, LifecycleState
from cxbridge_ros2.parameters import Parameters, ParameterValue
from cxbridge_ros2.rosout import RosoutPublisher
from cxbridge_ros2.settings import check_choice, locate_errors, read_node_section, typed_setting
from cxbridge_ros2.stamps import us_to_stamp

_SECTION: Final = "/ros2/node"
_KEYS: Final = ("name", "log")
_DIAGNOSTICS_TYPE: Final = "diagnostic_msgs/msg/DiagnosticArray"
_OK, _WARN, _ERROR = 0, 1, 2  # levels of diagnostic_msgs/DiagnosticStatus

_LEVELS: Final = {"debug": Level.DEBUG, "info": Level.INFO, "warn": Level.WARN, "error": Level.ERROR}
_SUBJECT: Final = "the node of ROS 2"


class Ros2NodeComponent(Component):
    """The managed node of a daemon."""

    hooks = (Hook.POST_LOOP,)
    steady = True  # clients resume a paused daemon
    description = "The daemon as a managed node of ROS 2"

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon
        values, settings = read_node_section(daemon.config, _SECTION, _KEYS, daemon.paths.confdir, _SUBJECT)
        with locate_errors(daemon.config, _SECTION):
            log_level = typed_setting(values, "log", "info", _SUBJECT)
            check_choice(log_level, _LEVELS, f"unknown log level '{log_level}'")
            name = typed_setting(values, "name", "cxbridge", _SUBJECT)
            if not name.isidentifier():
                raise ConfigError(f"'{name}' is not a valid node name", hint="use letters, digits and _")
        log = daemon.bus.logger("Ros2Node")
        self._node = node = settings.join(name, settings.load_definitions(), log.warn, daemon.rights)
        self._rosout = RosoutPublisher(node, name, _LEVELS[log_level])
        daemon.bus.subscribe(self._rosout, *RosoutPublisher.event_types)
        callbacks = {
            DEACTIVATE: lambda: self._run_command("pause"),
            ACTIVATE: lambda: self._run_command("resume"),
            SHUTDOWN: lambda: self._run_command("shutdown"),
            CLEANUP: lambda: False,  # fails, since a daemon is always configured
        }
        self._lifecycle = Lifecycle(node, name, callbacks, daemon.clock, log.error, LifecycleState.ACTIVE)
        parameters: dict[str, ParameterValue] = {
            "use_sim_time": daemon.clock.name == "ros2",
            "spec": daemon.spec,
        }
        self._parameters = Parameters(node, name, parameters, daemon.clock)
        self._diagnostics_publisher = node.create_publisher("/diagnostics", _DIAGNOSTICS_TYPE)
        self._clock, self._next_diagnostics_us, self._name = daemon.clock, 0, name
        daemon.add_endpoints([f"ROS 2 node /{name}"], "ROS 2")

    def _run_command(self, command: str) -> bool:
        """Carry out a command of the daemon; return True, since the transition has succeeded."""
        self._daemon.carry_out(command)
        return True

    def loop(self) -> None:
        """Handle requests, report transitions, and publish the states of components once a second.

        The reported transitions are those that clients of other protocols have requested.
        """
        self._node.poll()
        is_paused = self._daemon.lifecycle.paused
        self._lifecycle.report_state(LifecycleState.INACTIVE if is_paused else LifecycleState.ACTIVE)
        now_us = self._clock.now_us()
        if now_us >= self._next_diagnostics_us:
            self._next_diagnostics_us = now_us + MICROSECONDS  # the usual rate of /diagnostics
            statuses = [self._make_status(component) for component in self._daemon.lifecycle.status()]
            self._diagnostics_publisher.publish(
                {"header": {"stamp": us_to_stamp(now_us)}, "status": statuses}
            )

    def _make_status(self, component: ComponentStatus) -> Mapping[str, Any]:
        level = _ERROR if component.reason else _OK if component.state is State.ACTIVE else _WARN
        name, message = f"{self._name}: {component.name}", component.reason or component.state.name.lower()
        return {"level": level, "name": name, "message": message, "hardware_id": self._name}

    def close(self) -> None:
        self._daemon.bus.unsubscribe(self._rosout)
        self._node.close()
