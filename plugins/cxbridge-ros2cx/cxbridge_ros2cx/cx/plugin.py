"""The base class of the executive's plug-ins in Python, and the table of their classes.

A plug-in of the original is a class in C++ (``cx::FileLoadPlugin``). For each name of a plug-in in the
parameters one object of its class is made, which environments share. Its life: ``initialize`` once,
``init_context`` and ``context_destroyed`` for each environment, ``finalize`` once.
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

GROUP: Final = "cxbridge.cx_plugins"
"""The group of entry points with plug-ins of other packages: the name is the class of the original."""

GENERATED: Final = "cx::CX"
"""How the classes begin that the original generates for a type of ROS."""

_PLUGINS: Final = "cxbridge_ros2cx.cx.plugins"
_OWN: Final = {
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
    """Run the rules of an environment, and return how many fired; its lock must be held."""
    env.refresh_agenda()
    return env.run()


_NEWER: Final = {
    "cx::ConfigPlugin": f"{_PLUGINS}.config:NewerConfigPlugin",
    "cx::ExecutivePlugin": f"{_PLUGINS}.newer_executive:NewerExecutivePlugin",
}
"""The classes as of pull request 33 of June 2026."""


class NodeContext(Struct):
    """The shared state of a node's plug-ins.

    :param run_environment: runs the rules of an environment, and returns how many fired.
    """

    parameters: NodeParameters
    packages: Packages
    clock: Clock
    bus: EventBus
    ros: RosNode
    run_environment: Callable[[StockEnvironment], int] = run_rules
    connections: MakeConnections | None = None
    """Makes what carries protobuf messages; None: sockets."""
    is_newer: bool = False
    """Whether the checkout is of pull request 33 of June 2026 or later."""
    is_look: bool = False
    """Whether the agents are only looked at: who looks loads their files, and no rule fires."""


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
        """Read the parameters; environments get the plug-in afterwards."""

    def init_context(self, env: ClipsEnvironment) -> None:
        """Give the environment the plug-in's functions and templates.

        :raises CxbridgeError: when that fails: the environment does not have the plug-in then.
        """

    def take(self) -> None:
        """Take messages from other nodes; called before and after ticks."""

    def tick(self) -> None:
        """Do due work; called in each loop."""

    def finalize(self) -> None:
        """Release everything; no environment has the plug-in any more."""

    def parameter(self, name: str) -> str:
        """Return the whole name of a parameter of the plug-in."""
        return f"{self.name}.{name}"


MakePlugin = Callable[[str, NodeContext], CxPlugin]
"""Makes a plug-in of that name."""


def find_class(plugin: str, parameters: NodeParameters) -> str:
    """Return the class of the original that a plug-in's parameter names.

    :raises ConfigError: when the parameter is missing or no string, with file and line.
    """
    name = f"{plugin}.plugin"
    found: Parameter | None = parameters.find(name)
    text = parameters.get(name, "")
    if found is None or not text:
        raise ConfigError(
            f"the plug-in '{plugin}' has no class: there is no parameter '{name}'",
            file=parameters.file,
            line=found.place.line if found else None,
            hint=f'write below {plugin}: plugin: "cx::..."',
        )
    return text


def load_class(plugin: str, class_name: str, context: NodeContext) -> MakePlugin:
    """Return the implementation of a class.

    :raises ConfigError: when there is none, with file and line.
    """
    target, parameters = _OWN.get(class_name), context.parameters
    if context.is_newer:
        target = _NEWER.get(class_name, target)
    if target is not None:
        return _imported(target)
    from importlib.metadata import entry_points  # noqa: PLC0415 - only classes that cxbridge lacks pay

    others = {entry.name: entry for entry in entry_points(group=GROUP)}
    if class_name in others:
        loaded: MakePlugin = others[class_name].load()
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
            (*_OWN, *others),
            f"an own plug-in in C++ needs a stand-in in Python: a subclass of {__name__}.CxPlugin, as the "
            f"entry point '{class_name}' of the group {GROUP}",
        ),
    )


def as_known(plugin: str, error: Exception) -> CxbridgeError:
    """Return the error of a plug-in; of another exception one that names the plug-in, with file and line."""
    if isinstance(error, CxbridgeError):
        return error
    place = extract_tb(error.__traceback__)[-1]
    text = f"the plug-in '{plugin}' failed: {type(error).__name__}: {error}"
    return CxbridgeError(text, file=place.filename, line=place.lineno)


def _imported(target: str) -> MakePlugin:
    loaded: MakePlugin = resolve_name(target)
    return loaded
