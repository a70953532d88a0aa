"""The services that the node offers to peers.

Services create environments and load plug-ins, lead the node through its life cycle, and report its
parameters. Topics carry log lines, and the heartbeats by which the life-cycle manager of Nav2 watches the
node (its bond). Errors and log lines have the texts of the ROS 2 CX, carologistics/clips_executive.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError, Ros2Error
from cxbridge.executive.host.values import FALSE
from cxbridge.rights import Right
from cxbridge_ros2.lifecycle import ACTIVATE, DEACTIVATE, Lifecycle, LifecycleState
from cxbridge_ros2.parameters import Parameters
from cxbridge_ros2.rosout import RosoutPublisher
from cxbridge_ros2cx.cx.ros.handlers import wrap_handler
from cxbridge_ros2cx.cx.stock import StockOutput
from cxbridge_ros2cx.refresh import RefreshTimer

if TYPE_CHECKING:
    from cxbridge.events import Level
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2cx.cx.manager import CxManager

_PACKAGE: Final = "cx_msgs/srv"
_BOND: Final = "bond"
# time without a heartbeat after which a peer considers the bond broken, as in Nav2
_BOND_TIMEOUT_S: Final = 4.0
_LOGGING_SERVICE: Final = "set_topic_logging"
_LISTENER_NAME: Final = "topic"  # name of the listener that publishes an environment's lines
_INACTIVE_SERVICES: Final = ("list_envs", _LOGGING_SERVICE)  # services that an inactive node keeps

Fields = Mapping[str, Any]


class NodeServices(Closing):
    """The services of the node, offered as soon as the node is active or waits for its activation.

    :param transitions: a function for each transition that returns whether the transition has succeeded.
    :param state: the state of the node: active, or unconfigured while it waits.
    """

    def __init__(
        self, manager: CxManager, transitions: Mapping[str, Callable[[], bool]], state: LifecycleState
    ) -> None:
        self._manager, context = manager, manager.context
        self._node, self._name = context.ros.node, context.parameters.name.strip("/")
        self._close_functions: dict[str, Callable[[], None]] = {}
        self._rosout = RosoutPublisher(self._node, self._name)
        context.bus.subscribe(self._rosout, *RosoutPublisher.event_types)
        self._bond = Bond.from_parameters(manager) if state is LifecycleState.ACTIVE else None
        self._offer_services()
        if context.has_2026_changes:
            self._close_functions[_LOGGING_SERVICE] = TopicLogging(manager).close
        served_transitions: dict[str, Callable[[], bool]] = {
            **transitions,
            ACTIVATE: partial(self._activate, transitions[ACTIVATE]),
            DEACTIVATE: partial(self._deactivate, transitions[DEACTIVATE]),
        }
        self._lifecycle = Lifecycle(
            self._node, self._name, served_transitions, context.clock, manager.log.error, state
        )
        # messages have lists in place of tuples
        values: dict[str, Any] = {
            name: list(parameter.value) if isinstance(parameter.value, tuple) else parameter.value
            for name, parameter in context.parameters
        }
        self._parameters = Parameters(self._node, self._name, values, context.clock)

    def _offer_services(self) -> None:
        services: tuple[tuple[str, str, Callable[[Message], Fields]], ...] = (
            ("list_envs", "ListClipsEnvs", self._list_environments),
            ("create_env", "CreateClipsEnv", self._create_environment),
            ("destroy_env", "DestroyClipsEnv", self._destroy_environment),
            ("load_plugin", "LoadClipsPlugin", self._load_plugin),
            ("unload_plugin", "UnloadClipsPlugin", self._unload_plugin),
            ("list_plugins", "ListClipsPlugins", self._list_plugins),
        )
        for name, service_type, handler in services:
            if name in self._close_functions:  # an inactive node has kept this service
                continue
            try:
                self._close_functions[name] = self._node.serve(
                    f"/{self._name}/{name}",
                    f"{_PACKAGE}/{service_type}",
                    wrap_handler(handler, self._manager.log.error),
                    right=Right.CONTROL,
                )
            except Ros2Error as error:
                self._manager.log.warn(
                    f"services for environments are not offered: {error.message}; "
                    "name a checkout or workspace with cx_msgs with --ros2cx"
                )
                return

    # --- environments -------------------------------------------------------------------------------------

    def _require_environment(self, request: Message, error: str = "unknown environment") -> str:
        """Return the name of a request's environment.

        :raises CxbridgeError: if there is no such environment.
        """
        if request["env_name"] not in self._manager.environments:
            raise CxbridgeError(error)
        return str(request["env_name"])

    def _list_environments(self, _request: Message) -> Fields:
        return {"envs": list(self._manager.environments)}

    def _create_environment(self, request: Message) -> Fields:
        """Create an environment with its plug-ins, whose rules run at the next tick."""
        self._manager.create(request["env_name"])
        self._manager.load_plugins(request["env_name"])
        return {}

    def _destroy_environment(self, request: Message) -> Fields:
        name = self._require_environment(request, "unknown Environment name")
        self._manager.log.warn(f"Deleting '{name}' --- Clips Environment...")
        self._manager.destroy(name)
        self._manager.log.warn(f"Deleted '{name}' --- Clips Environment!")
        return {}

    # --- plug-ins -----------------------------------------------------------------------------------------

    def _load_plugin(self, request: Message) -> Fields:
        if self._manager.request(self._require_environment(request), request["plugin_name"]) == FALSE:
            raise CxbridgeError("error while loading plugin")
        return {}

    def _unload_plugin(self, request: Message) -> Fields:
        name = self._require_environment(request)
        if request["plugin_name"] not in self._manager.loaded_features(name):
            raise CxbridgeError("unknown plugin")
        self._manager.destroy_context(name, request["plugin_name"])
        return {}

    def _list_plugins(self, request: Message) -> Fields:
        # before pull request 33, the ROS 2 CX sends an empty list for a request without an environment
        if not request["env_name"] and not self._manager.context.has_2026_changes:
            return {"plugins": []}
        return {"plugins": list(self._manager.loaded_features(self._require_environment(request)))}

    # --- transitions --------------------------------------------------------------------------------------

    def _activate(self, activate: Callable[[], bool]) -> bool:
        has_succeeded = activate()
        # without a check of the result, since a failed activation raises its error
        self._offer_services()
        self._bond = Bond.from_parameters(self._manager)
        return has_succeeded

    def _deactivate(self, deactivate: Callable[[], bool]) -> bool:
        has_succeeded = deactivate()
        for name in [name for name in self._close_functions if name not in _INACTIVE_SERVICES]:
            self._close_functions.pop(name)()
        self._break_bond()
        return has_succeeded

    def tick(self) -> None:
        """Send the heartbeat of the bond when it is due."""
        if self._bond is not None:
            self._bond.tick()

    def _break_bond(self) -> None:
        if self._bond is not None:
            self._bond.close()
            self._bond = None

    def close(self) -> None:
        self._break_bond()
        self._manager.bus.unsubscribe(self._rosout)
        for name in list(self._close_functions):
            self._close_functions.pop(name)()
        self._lifecycle.close()
        self._parameters.close()
        self._rosout.close()


class Bond(Closing):
    """The bond of an active node, which sends heartbeats on the topic ``bond``.

    :param period_s: the time between two heartbeats.
    """

    def __init__(self, manager: CxManager, period_s: float) -> None:
        context = manager.context
        self._publisher = context.ros.node.create_publisher(context.ros.full_name(_BOND), "bond/msg/Status")
        self._timer = RefreshTimer(context.clock, int(period_s * MICROSECONDS))
        self._status = {
            "id": context.parameters.name.rpartition("/")[2],
            "instance_id": str(uuid.uuid4()),
            "active": True,
            "heartbeat_timeout": _BOND_TIMEOUT_S,
            "heartbeat_period": period_s,
        }
        self._publisher.publish(self._status)

    @classmethod
    def from_parameters(cls, manager: CxManager) -> Bond | None:
        """Return the bond that the parameters configure; None without a positive heartbeat period."""
        period_s = manager.context.parameters.get(f"{_BOND}_heartbeat_period", 0.0)
        return cls(manager, period_s) if period_s > 0.0 else None

    def tick(self) -> None:
        if self._timer.advance_if_due():
            self._publisher.publish(self._status)

    def close(self) -> None:
        self._publisher.publish(self._status | {"active": False})
        self._publisher.close()


class TopicLogging:
    """Publishes the log lines of the environments that a parameter or a peer has selected.

    The service exists since pull request 33 of carologistics/clips_executive (June 2026).
    """

    def __init__(self, manager: CxManager) -> None:
        self._manager, node = manager, manager.context.ros.node
        name = manager.context.parameters.name
        self._publisher = node.create_publisher(f"{name}/clips_log", "cx_msgs/msg/Log")
        self.close: Callable[[], None] = node.serve(
            f"{name}/{_LOGGING_SERVICE}",
            f"{_PACKAGE}/SetTopicLogging",
            self._set_logging,
            right=Right.CONTROL,
        )
        for env_name in manager.environments:
            if manager.context.parameters.get(f"{env_name}.log_clips_to_topic", default=False):
                self._switch_logging(env_name, is_enabled=True)

    def _set_logging(self, request: Message) -> Fields:
        self._switch_logging(request["env_name"], is_enabled=request["enabled"])
        return {"success": True}

    def _switch_logging(self, env_name: str, *, is_enabled: bool) -> None:
        env = self._manager.environments.get(env_name)
        if env is not None:  # as in the ROS 2 CX, an unknown environment is no error
            env.line_listeners.pop(_LISTENER_NAME, None)
            if is_enabled:
                env.line_listeners[_LISTENER_NAME] = partial(self._publish, env)

    def _publish(self, env: ClipsEnvironment, _level: Level, line: str) -> None:
        logical_name = env.output.logical_name if isinstance(env.output, StockOutput) else ""
        self._publisher.publish({"env_name": env.name, "logical_name": logical_name, "line": line})
