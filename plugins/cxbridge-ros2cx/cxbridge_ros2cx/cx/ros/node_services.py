"""The services that the node offers to peers.

Services create environments and load plug-ins, lead the node through its life cycle, and report its
parameters. A topic carries log lines. Errors and log lines have the texts of the ROS 2 CX,
carologistics/clips_executive.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError, Ros2Error
from cxbridge.executive.host.values import FALSE
from cxbridge.rights import Right
from cxbridge_ros2.lifecycle import ACTIVATE, CONFIGURE, DEACTIVATE, SHUTDOWN, Lifecycle, LifecycleState
from cxbridge_ros2.parameters import Parameters
from cxbridge_ros2.rosout import RosoutPublisher
from cxbridge_ros2cx.cx.ros.handlers import wrap_handler

if TYPE_CHECKING:
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2cx.cx.manager import CxManager

_PACKAGE: Final = "cx_msgs/srv"
_INACTIVE_SERVICE: Final = "list_envs"  # the service that an inactive node keeps

Fields = Mapping[str, Any]


class NodeServices(Closing):
    """The services of the node, offered when it is activated, or when it begins to wait for its activation.

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
        context.bus.subscribe(self._rosout, *RosoutPublisher.events)
        self._offer_services()
        report, clock = manager.log.error, context.clock
        served_transitions: dict[str, Callable[[], bool]] = {
            CONFIGURE: transitions[CONFIGURE],
            ACTIVATE: partial(self._activate, transitions[ACTIVATE]),
            DEACTIVATE: partial(self._deactivate, transitions[DEACTIVATE]),
            SHUTDOWN: transitions[SHUTDOWN],
        }
        self._lifecycle = Lifecycle(self._node, self._name, served_transitions, clock, report, state)
        node_parameters = {name: _to_message_value(parameter.value) for name, parameter in context.parameters}
        self._parameters = Parameters(self._node, self._name, node_parameters, clock)

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
                hint = "name a checkout or workspace with cx_msgs with --ros2cx"
                self._manager.log.warn(f"services for environments are not offered: {error.message}; {hint}")
                return

    # --- environments -------------------------------------------------------------------------------------

    def _require_environment(self, request: Message, error: str = "unknown environment") -> str:
        name: str = request["env_name"]
        if name not in self._manager.environments:
            raise CxbridgeError(error)
        return name

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
        name = self._require_environment(request)
        if self._manager.request(name, request["plugin_name"]) == FALSE:
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
        return has_succeeded

    def _deactivate(self, deactivate: Callable[[], bool]) -> bool:
        has_succeeded = deactivate()
        for name in [name for name in self._close_functions if name != _INACTIVE_SERVICE]:
            self._close_functions.pop(name)()
        return has_succeeded

    def close(self) -> None:
        self._manager.bus.unsubscribe(self._rosout)
        while self._close_functions:
            self._close_functions.popitem()[1]()
        self._lifecycle.close()
        self._parameters.close()
        self._rosout.close()


def _to_message_value(value: Any) -> Any:
    """Return a parameter's value for messages, which have lists in place of tuples."""
    return list(value) if isinstance(value, tuple) else value
