"""The services of the node: environments and plug-ins, life cycle, parameters, log and bond."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError, Ros2Error
from cxbridge.executive.host.loggers import ClipsLogger
from cxbridge.executive.host.values import FALSE
from cxbridge.rights import Right
from cxbridge_ros2.lifecycle import ACTIVATE, CONFIGURE, DEACTIVATE, SHUTDOWN, Lifecycle, LifecycleState
from cxbridge_ros2.parameters import Parameter, Parameters
from cxbridge_ros2.rosout import RosoutPublisher
from cxbridge_ros2cx.cx.stock import StockOutput
from cxbridge_ros2cx.refresh import RefreshTimer

if TYPE_CHECKING:
    from cxbridge.events import Level
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2cx.cx.manager import CxManager

_PACKAGE: Final = "cx_msgs/srv"
_BOND: Final = "bond"
_BOND_TIMEOUT_S: Final = 4.0  # the original's heartbeat timeout, after which a peer considers the bond broken
_LOGS: Final = "set_topic_logging"
_LOGGER: Final = "topic"  # name of the logger that publishes an environment's lines
_INACTIVE_SERVICES: Final = ("list_envs", _LOGS)  # services that an inactive node keeps

Fields = Mapping[str, Any]


class NodeServices(Closing):
    """The services of the node after its activation.

    :param work: a function for each transition that returns whether the transition has succeeded.
    :param state: the state of the node: active or unconfigured.
    """

    def __init__(
        self, manager: CxManager, work: Mapping[str, Callable[[], bool]], state: LifecycleState
    ) -> None:
        self._manager, context = manager, manager.context
        self._node, self._name = context.ros.node, context.parameters.name.strip("/")
        self._closers: dict[str, Callable[[], None]] = {}
        self._rosout = RosoutPublisher(self._node, self._name)
        context.bus.subscribe(self._rosout, *RosoutPublisher.events)
        self._bond = Bond.of(manager) if state is LifecycleState.ACTIVE else None
        self._serve()
        if context.is_newer:
            self._closers[_LOGS] = TopicLogs(manager).close
        report, clock = manager.log.error, context.clock
        transitions: dict[str, Callable[[], bool]] = {
            CONFIGURE: work[CONFIGURE],
            ACTIVATE: partial(self._activate, work[ACTIVATE]),
            DEACTIVATE: partial(self._deactivate, work[DEACTIVATE]),
            SHUTDOWN: work[SHUTDOWN],
        }
        self._lifecycle = Lifecycle(self._node, self._name, transitions, clock, report, state)
        declared = {
            name: Parameter(_with_lists(parameter.value), read_only=True)
            for name, parameter in context.parameters
        }
        self._parameters = Parameters(self._node, self._name, declared, clock)

    def _serve(self) -> None:
        services: tuple[tuple[str, str, Callable[[Message], Fields]], ...] = (
            ("list_envs", "ListClipsEnvs", self._list_environments),
            ("create_env", "CreateClipsEnv", self._create),
            ("destroy_env", "DestroyClipsEnv", self._destroy),
            ("load_plugin", "LoadClipsPlugin", self._load),
            ("unload_plugin", "UnloadClipsPlugin", self._unload),
            ("list_plugins", "ListClipsPlugins", self._list_plugins),
        )
        for name, kind, handler in services:
            if name in self._closers:  # an inactive node has kept this service
                continue
            try:
                self._closers[name] = self._node.serve(
                    f"/{self._name}/{name}",
                    f"{_PACKAGE}/{kind}",
                    self._with_error_responses(handler),
                    right=Right.CONTROL,
                )
            except Ros2Error as error:
                hint = "name a checkout or workspace with cx_msgs with --ros2cx"
                self._manager.log.warn(f"services for environments are not offered: {error.message}; {hint}")
                return

    def _with_error_responses(self, handler: Callable[[Message], Fields]) -> Callable[[Message], Fields]:
        """Return a handler that logs errors of another handler and reports them in its response."""

        def respond(request: Message) -> Fields:
            try:
                return {"success": True, **handler(request)}
            except CxbridgeError as error:
                self._manager.log.error(str(error))
                return {"success": False, "error": error.message}

        return respond

    # --- environments -------------------------------------------------------------------------------------

    def _environment_of(self, request: Message, error: str = "unknown environment") -> str:
        name: str = request["env_name"]
        if name not in self._manager.environments:
            raise CxbridgeError(error)
        return name

    def _list_environments(self, _request: Message) -> Fields:
        return {"envs": list(self._manager.environments)}

    def _create(self, request: Message) -> Fields:
        """Create an environment with its plug-ins; its rules run at the next tick."""
        self._manager.create(request["env_name"])
        self._manager.load_plugins(request["env_name"])
        return {}

    def _destroy(self, request: Message) -> Fields:
        name = self._environment_of(request, "unknown Environment name")
        self._manager.log.warn(f"Deleting '{name}' --- Clips Environment...")
        self._manager.destroy(name)
        self._manager.log.warn(f"Deleted '{name}' --- Clips Environment!")
        return {}

    # --- plug-ins -----------------------------------------------------------------------------------------

    def _load(self, request: Message) -> Fields:
        name = self._environment_of(request)
        if self._manager.request(name, request["plugin_name"]) == FALSE:
            raise CxbridgeError("error while loading plugin")
        return {}

    def _unload(self, request: Message) -> Fields:
        name = self._environment_of(request)
        if request["plugin_name"] not in self._manager.loaded_features(name):
            raise CxbridgeError("unknown plugin")
        self._manager.destroy_context(name, request["plugin_name"])
        return {}

    def _list_plugins(self, request: Message) -> Fields:
        # before pull request 33, the original answers a request without an environment with an empty list
        if not request["env_name"] and not self._manager.context.is_newer:
            return {"plugins": []}
        return {"plugins": list(self._manager.loaded_features(self._environment_of(request)))}

    # --- transitions --------------------------------------------------------------------------------------

    def _activate(self, activate: Callable[[], bool]) -> bool:
        succeeded = activate()
        self._serve()  # the services that the deactivation has closed
        self._bond = Bond.of(self._manager)
        return succeeded

    def _deactivate(self, deactivate: Callable[[], bool]) -> bool:
        succeeded = deactivate()
        for name in [name for name in self._closers if name not in _INACTIVE_SERVICES]:
            self._closers.pop(name)()
        self._break_bond()
        return succeeded

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
        while self._closers:
            self._closers.popitem()[1]()
        self._lifecycle.close()
        self._parameters.close()
        self._rosout.close()


class Bond(Closing):
    """The bond of an active node: heartbeats on the topic ``bond`` until the bond is broken.

    :param period: seconds between heartbeats.
    """

    def __init__(self, manager: CxManager, period: float) -> None:
        context = manager.context
        self._topic = context.ros.node.create_publisher(context.ros.full_name(_BOND), "bond/msg/Status")
        self._timer = RefreshTimer(context.clock, int(period * MICROSECONDS))
        self._status = {
            "id": context.parameters.name.rpartition("/")[2],
            "instance_id": str(uuid.uuid4()),
            "active": True,
            "heartbeat_timeout": _BOND_TIMEOUT_S,
            "heartbeat_period": period,
        }
        self._topic.publish(self._status)

    @classmethod
    def of(cls, manager: CxManager) -> Bond | None:
        """Return the bond that the parameters configure; None without a heartbeat period."""
        period = manager.context.parameters.get(f"{_BOND}_heartbeat_period", 0.0)
        return cls(manager, period) if period > 0.0 else None

    def tick(self) -> None:
        if self._timer.advance_if_due():
            self._topic.publish(self._status)

    def close(self) -> None:
        self._topic.publish(self._status | {"active": False})
        self._topic.close()


class TopicLogs:
    """Publishes the log lines of the environments that a parameter or a peer has selected.

    The service exists since pull request 33 of carologistics/clips_executive (June 2026).
    """

    def __init__(self, manager: CxManager) -> None:
        self._manager, node = manager, manager.context.ros.node
        name = manager.context.parameters.name
        self._publisher = node.create_publisher(f"{name}/clips_log", "cx_msgs/msg/Log")
        self.close: Callable[[], None] = node.serve(
            f"{name}/{_LOGS}", f"{_PACKAGE}/SetTopicLogging", self._set, right=Right.CONTROL
        )
        for env in manager.environments:
            if manager.context.parameters.get(f"{env}.log_clips_to_topic", default=False):
                self._switch(env, on=True)

    def _set(self, request: Message) -> Fields:
        self._switch(request["env_name"], on=request["enabled"])
        return {"success": True}

    def _switch(self, name: str, *, on: bool) -> None:
        env = self._manager.environments.get(name)
        if env is None:  # the original, too, reports success for an unknown environment
            return
        if any(logger.name == _LOGGER for logger in env.loggers.loggers):
            env.loggers.remove(_LOGGER)
        if on:
            env.loggers.add(ClipsLogger(_LOGGER, partial(self._publish, env), component=name))

    def _publish(self, env: ClipsEnvironment, _level: Level, line: str) -> None:
        logical_name = env.output.logical_name if isinstance(env.output, StockOutput) else ""
        self._publisher.publish({"env_name": env.name, "logical_name": logical_name, "line": line})


def _with_lists(value: Any) -> Any:
    """Return a parameter's value for messages, which have lists in place of tuples."""
    return list(value) if isinstance(value, tuple) else value
