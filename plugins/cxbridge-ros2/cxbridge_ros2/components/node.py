"""The daemon as a managed node of ROS 2: its log is on /rosout, and clients pause, resume and stop it."""

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
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.lifecycle import ACTIVATE, CLEANUP, DEACTIVATE, SHUTDOWN, Lifecycle, LifecycleState
from cxbridge_ros2.parameters import Parameter, Parameters
from cxbridge_ros2.rosout import RosoutPublisher
from cxbridge_ros2.settings import locate_errors, read_node_section, typed_setting
from cxbridge_ros2.stamps import us_to_stamp

SECTION: Final = "/ros2/node"
_KEYS: Final = ("name", "log")
_DIAGNOSTICS: Final = "diagnostic_msgs/msg/DiagnosticArray"
_OK, _WARN, _ERROR = 0, 1, 2  # levels of diagnostic_msgs/DiagnosticStatus

_LEVELS: Final = {"debug": Level.DEBUG, "info": Level.INFO, "warn": Level.WARN, "error": Level.ERROR}
_COMPONENT: Final = "the node of ROS 2"


class Ros2NodeComponent(Component):
    """The node, which other nodes see as a managed node of ROS."""

    hooks = (Hook.POST_LOOP,)
    steady = True
    description = "The daemon as a managed node of ROS 2"

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon
        values, settings = read_node_section(daemon.config, SECTION, _KEYS, daemon.paths.confdir, _COMPONENT)
        with locate_errors(daemon.config, SECTION):
            name, level = _name_and_level(values)
        warn = daemon.bus.logger("Ros2Node").warn
        self._node = node = settings.join(name, settings.load_definitions(), warn, daemon.rights)
        try:
            self._rosout = RosoutPublisher(node, name, level)
            daemon.bus.subscribe(self._rosout, *RosoutPublisher.events)
            callbacks = {
                DEACTIVATE: lambda: self._carry_out("pause"),
                ACTIVATE: lambda: self._carry_out("resume"),
                SHUTDOWN: lambda: self._carry_out("shutdown"),
                CLEANUP: lambda: False,  # a daemon is always configured
            }
            report = daemon.bus.logger("Ros2Node").error
            self._lifecycle = Lifecycle(node, name, callbacks, daemon.clock, report, LifecycleState.ACTIVE)
            # read-only: a run has them from its start
            parameters = {
                "use_sim_time": Parameter(value=daemon.clock.name == "ros2", read_only=True),
                "spec": Parameter(daemon.spec, "what the executive does", read_only=True),
            }
            self._parameters = Parameters(node, name, parameters, daemon.clock)
        except Exception:
            node.close()
            raise
        self._diagnostics = node.create_publisher("/diagnostics", _DIAGNOSTICS)
        self._clock, self._diagnostics_us, self._name = daemon.clock, 0, name
        daemon.add_endpoints([f"ROS 2 node /{name}"], "ROS 2")

    def _carry_out(self, command: str) -> bool:
        self._daemon.carry_out(command)
        return True

    def loop(self) -> None:
        """Answer requests, and report transitions requested in other ways."""
        self._node.poll()
        is_paused = self._daemon.lifecycle.paused
        self._lifecycle.report_state(LifecycleState.INACTIVE if is_paused else LifecycleState.ACTIVE)
        now_us = self._clock.now_us()
        if now_us >= self._diagnostics_us:
            self._diagnostics_us = now_us + MICROSECONDS  # once a second, the usual rate of /diagnostics
            rows = [self._status(row) for row in self._daemon.lifecycle.status()]
            self._diagnostics.publish({"header": {"stamp": us_to_stamp(now_us)}, "status": rows})

    def _status(self, row: ComponentStatus) -> Mapping[str, Any]:
        level = _ERROR if row.reason else _OK if row.state is State.ACTIVE else _WARN
        name, message = f"{self._name}: {row.name}", row.reason or row.state.name.lower()
        return {"level": level, "name": name, "message": message, "hardware_id": self._name}

    def close(self) -> None:
        self._daemon.bus.unsubscribe(self._rosout)
        self._node.close()


def _name_and_level(values: Mapping[str, Any]) -> tuple[str, Level]:
    log = typed_setting(values, "log", "info", _COMPONENT)
    if log not in _LEVELS:
        raise ConfigError(
            f"there is no level '{log}' of logs",
            hint=did_you_mean(log, _LEVELS, f"use one of: {', '.join(_LEVELS)}"),
        )
    name = typed_setting(values, "name", "cxbridge", _COMPONENT)
    if not name.isidentifier():
        raise ConfigError(f"'{name}' is not a name of a node", hint="use letters, digits and _")
    return name, _LEVELS[log]
