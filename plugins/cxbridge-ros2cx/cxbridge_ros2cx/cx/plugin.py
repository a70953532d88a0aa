"""The base class of the executive's plug-ins in Python, and the table of plug-in classes.

A plug-in of the original (carologistics/clips_executive) is a C++ class (``cx::FileLoadPlugin``). The
environments share one object per plug-in name of the parameters. Its life: ``initialize`` once,
``init_context`` and ``context_destroyed`` per environment, ``finalize`` once.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from pkgutil import resolve_name
from traceback import extract_tb
from typing import TYPE_CHECKING, Final

from msgspec import Struct

from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.executive.feature import Feature
from cxbridge.suggestions import did_you_mean

if TYPE_CHECKING:
    from cxbridge.clock import Clock
    from cxbridge.events import EventBus, Logger
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_protobuf.connections import MakeConnections
    from cxbridge_ros2cx.cx.packages import Packages
    from cxbridge_ros2cx.cx.parameters import NodeParameters, Parameter
    from cxbridge_ros2cx.cx.ros.node import RosNode
    from cxbridge_ros2cx.cx.stock import StockEnvironment

# The entry point group for plug-ins of other packages: an entry point has the name of the C++ class.
GROUP: Final = "cxbridge.cx_plugins"

GENERATED: Final = "cx::CX"  # prefix of the classes that the original generates for ROS types

_PLUGINS: Final = "cxbridge_ros2cx.cx.plugins"
_SHIPPED_CLASSES: Final = {
    "cx::AmentIndexPlugin": f"{_PLUGINS}.ament_index:AmentIndexPlugin",
    "cx::ConfigPlugin": f"{_PLUGINS}.config:ConfigPlugin",
    "cx::ExamplePlugin": f"{_PLUGINS}.example:ExamplePlugin",
    "cx::ExecutivePlugin": f"{_PLUGINS}.executive:ExecutivePlugin",
    "cx::FileLoadPlugin": f"{_PLUGINS}.file_load:FileLoadPlugin",
    "cx::ProtobufPlugin": f"{_PLUGINS}.protobuf:ProtobufPlugin",
    "cx::RosMsgsPlugin": f"{_PLUGINS}.ros_msgs:RosMsgsPlugin",
    "cx::RosParamPlugin": f"{_PLUGINS}.ros_param:RosParamPlugin",
    "cx::Tf2PoseTrackerPlugin": f"{_PLUGINS}.tf2_pose_tracker:Tf2PoseTrackerPlugin",
}


def run_rules(env: StockEnvironment) -> int:
    """Run an environment's rules and return the number of firings; the caller holds its lock."""
    env.refresh_agenda()
    return env.run()


# The classes that replace shipped ones since pull request 33 of carologistics/clips_executive (June 2026).
_NEWER_CLASSES: Final = {
    "cx::ConfigPlugin": f"{_PLUGINS}.config:NewerConfigPlugin",
    "cx::ExecutivePlugin": f"{_PLUGINS}.newer_executive:NewerExecutivePlugin",
}


class NodeContext(Struct):
    """The shared state of a node's plug-ins.

    :param run_environment: runs the rules of an environment and returns the number of firings.
    """

    parameters: NodeParameters
    packages: Packages
    clock: Clock
    bus: EventBus
    ros: RosNode
    run_environment: Callable[[StockEnvironment], int] = run_rules
    connections: MakeConnections | None = None  # factory of protobuf connections; None for sockets
    is_newer: bool = False  # whether the checkout has the changes of pull request 33 (June 2026)
    # Whether agents are only inspected: the caller loads their files, and no rule fires.
    is_look: bool = False


class CxPlugin(Feature):
    """A plug-in.

    :param name: the name in the parameters.
    """

    def __init__(self, name: str, context: NodeContext) -> None:
        self.name = name
        self.context = context
        self.parameters: NodeParameters = context.parameters
        self.log: Logger = context.bus.logger(name)

    def initialize(self) -> None:
        """Read the parameters, before any environment gets the plug-in."""

    def init_context(self, env: ClipsEnvironment) -> None:
        """Define the plug-in's functions and templates in an environment.

        :raises CxbridgeError: if that fails; the environment then lacks the plug-in.
        """

    def take(self) -> None:
        """Receive messages from other nodes; called before and after ticks."""

    def tick(self) -> None:
        """Do due work; called in each loop."""

    def finalize(self) -> None:
        """Release all resources after all environments have unloaded the plug-in."""

    def parameter(self, name: str) -> str:
        """Return the full name of a parameter of the plug-in."""
        return f"{self.name}.{name}"


MakePlugin = Callable[[str, NodeContext], CxPlugin]  # creates a plug-in with a name


def find_class(plugin: str, parameters: NodeParameters) -> str:
    """Return the C++ class of a plug-in.

    :raises ConfigError: if the parameters name no class.
    """
    name = f"{plugin}.plugin"
    parameter: Parameter | None = parameters.find(name)
    text = parameters.get(name, "")
    if parameter is None or not text:
        raise ConfigError(
            f"the plug-in '{plugin}' has no class: there is no parameter '{name}'",
            file=parameters.file,
            line=parameter.mark.line if parameter else None,
            hint=f'write below {plugin}: plugin: "cx::..."',
        )
    return text


def load_class(plugin: str, class_name: str, context: NodeContext) -> MakePlugin:
    """Return the Python class that stands in for a C++ class.

    :raises ConfigError: if cxbridge has no such class.
    """
    target, parameters = _SHIPPED_CLASSES.get(class_name), context.parameters
    if context.is_newer:
        target = _NEWER_CLASSES.get(class_name, target)
    if target is not None:
        return _import_class(target)
    from importlib.metadata import entry_points  # noqa: PLC0415 - slow, and rarely needed

    external_classes = {entry.name: entry for entry in entry_points(group=GROUP)}
    if class_name in external_classes:
        loaded: MakePlugin = external_classes[class_name].load()
        return loaded
    linked = context.packages.linked_protos(class_name)
    if linked:
        return partial(import_module(f"{_PLUGINS}.protobuf").ProtobufPlugin, linked=linked)
    if class_name.startswith(GENERATED):
        generated = import_module(f"{_PLUGINS}.generated")
        kind = generated.find_type(class_name, context)
        if kind is not None:
            return partial(generated.GeneratedPlugin, kind=kind)
    raise parameters.wrong(
        f"{plugin}.plugin",
        f"names a class that cxbridge does not have: {class_name}",
        did_you_mean(
            class_name,
            (*_SHIPPED_CLASSES, *external_classes),
            f"an own plug-in in C++ needs a stand-in in Python: a subclass of {__name__}.CxPlugin, as the "
            f"entry point '{class_name}' of the group {GROUP}",
        ),
    )


def with_place(plugin: str, error: Exception) -> CxbridgeError:
    """Return an error of cxbridge unchanged, another exception as an error with plug-in, file and line."""
    if isinstance(error, CxbridgeError):
        return error
    frame = extract_tb(error.__traceback__)[-1]
    text = f"the plug-in '{plugin}' failed: {type(error).__name__}: {error}"
    return CxbridgeError(text, file=frame.filename, line=frame.lineno)


def _import_class(target: str) -> MakePlugin:
    loaded: MakePlugin = resolve_name(target)
    return loaded
