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
from cxbridge_ros2.executor import typed
from cxbridge_ros2.frames import stamp
from cxbridge_ros2.lifecycle import ACTIVATE, CLEANUP, DEACTIVATE, SHUTDOWN, Lifecycle, LifecycleState
from cxbridge_ros2.parameters import Parameter, Parameters
from cxbridge_ros2.rosout import Rosout
from cxbridge_ros2.trees import node_settings, placed

TREE: Final = "/ros2/node"
_OWN: Final = ("name", "log")
_DIAGNOSTICS: Final = "diagnostic_msgs/msg/DiagnosticArray"
_FINE, _IDLE, _FAILED = 0, 1, 2  # OK, WARN and ERROR of diagnostic_msgs/DiagnosticStatus

_LEVELS: Final = {"debug": Level.DEBUG, "info": Level.INFO, "warn": Level.WARN, "error": Level.ERROR}
_WHOSE: Final = "the node of ROS 2"


class Ros2NodeComponent(Component):
    hooks = (Hook.POST_LOOP,)
    steady = True
    description = "The daemon as a managed node of ROS 2"

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon
        values, settings = node_settings(daemon.config, TREE, _OWN, daemon.paths.confdir, _WHOSE)
        with placed(daemon.config, TREE):
            name, level = _name_and_level(values)
        warn = daemon.bus.logger("Ros2Node").warn
        self._node = node = settings.join(name, settings.definitions(), warn, daemon.rights)
        try:
            self._rosout = Rosout(node, name, level)
            daemon.bus.subscribe(self._rosout, *Rosout.events)
            work = {
                DEACTIVATE: lambda: self._carry_out("pause"),
                ACTIVATE: lambda: self._carry_out("resume"),
                SHUTDOWN: lambda: self._carry_out("shutdown"),
                CLEANUP: lambda: False,  # a daemon is always configured
            }
            report = daemon.bus.logger("Ros2Node").error
            self._lifecycle = Lifecycle(node, name, work, daemon.clock, report, LifecycleState.ACTIVE)
            own = {
                "use_sim_time": Parameter(value=daemon.clock.name == "ros2", read_only=True),
                "spec": Parameter(daemon.spec, "what the executive does", read_only=True),
            }
            self._parameters = Parameters(node, name, own, daemon.clock)
        except Exception:
            node.close()
            raise
        self._diagnostics = node.publisher("/diagnostics", _DIAGNOSTICS)
        self._clock, self._next_us, self._name = daemon.clock, 0, name
        self._bus = daemon.bus
        daemon.add_endpoints([f"ROS 2 node /{name}"], "ROS 2")

    def _carry_out(self, command: str) -> bool:
        self._daemon.carry_out(command)
        return True

    def loop(self) -> None:
        """Answer requests, and report transitions requested in other ways."""
        self._node.poll()
        is_paused = self._daemon.lifecycle.paused
        self._lifecycle.follow(LifecycleState.INACTIVE if is_paused else LifecycleState.ACTIVE)
        # Once a second, the usual rate of /diagnostics.
        if self._clock.now_us() >= self._next_us:
            self._next_us = self._clock.now_us() + MICROSECONDS
            rows = [self._status(row) for row in self._daemon.lifecycle.status()]
            self._diagnostics.publish({"header": {"stamp": stamp(self._clock.now_us())}, "status": rows})

    def _status(self, row: ComponentStatus) -> Mapping[str, Any]:
        level = _FAILED if row.reason else _FINE if row.state is State.ACTIVE else _IDLE
        name, message = f"{self._name}: {row.name}", row.reason or row.state.name.lower()
        return {"level": level, "name": name, "message": message, "hardware_id": self._name}

    def close(self) -> None:
        self._bus.unsubscribe(self._rosout)
        self._node.close()


def _name_and_level(values: Mapping[str, Any]) -> tuple[str, Level]:
    log = typed(values, "log", "info", _WHOSE)
    if log not in _LEVELS:
        hint = did_you_mean(log, _LEVELS, f"use one of: {', '.join(_LEVELS)}")
        raise ConfigError(f"there is no level '{log}' of logs", hint=hint)
    name = typed(values, "name", "cxbridge", _WHOSE)
    if not name.isidentifier():
        raise ConfigError(f"'{name}' is not a name of a node", hint="use letters, digits and _")
    return name, _LEVELS[log]
