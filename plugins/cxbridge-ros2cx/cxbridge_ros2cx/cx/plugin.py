"""The base class of plug-ins for environments, and the table of plug-in classes.

In the ROS 2 CX (carologistics/clips_executive) a plug-in is a C++ class, e.g. ``cx::FileLoadPlugin``, which
adds functions, templates and facts to environments. The parameters list plug-ins by name, each with its C++
class, which a Python class replaces here. All environments share one object per name. The node calls
``initialize`` once, ``init_context`` and ``context_destroyed`` for each environment, and ``finalize`` once.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from pkgutil import resolve_name
from traceback import extract_tb
from typing import TYPE_CHECKING, Final

from msgspec import Struct

from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.executive.feature import Feature
from cxbridge.executive.host.values import FALSE
from cxbridge.suggestions import did_you_mean

if TYPE_CHECKING:
    from pathlib import Path

    from cxbridge.clock import Clock
    from cxbridge.events import EventBus, Logger
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge_protobuf.connections import MakeConnections
    from cxbridge_ros2cx.cx.packages import Packages
    from cxbridge_ros2cx.cx.parameters import NodeParameters
    from cxbridge_ros2cx.cx.ros.node import RosNode
    from cxbridge_ros2cx.cx.stock import StockEnvironment

# the entry point group for plug-ins of installed packages: an entry point has the name of the C++ class
PLUGIN_GROUP: Final = "cxbridge.cx_plugins"

# the prefix of the classes that the build of the ROS 2 CX generates for ROS types
GENERATED_CLASS_PREFIX: Final = "cx::CX"

_PLUGIN_PACKAGE: Final = "cxbridge_ros2cx.cx.plugins"
_SHIPPED_CLASSES: Final = {
    "cx::AmentIndexPlugin": f"{_PLUGIN_PACKAGE}.ament_index:AmentIndexPlugin",
    "cx::ConfigPlugin": f"{_PLUGIN_PACKAGE}.config:ConfigPlugin",
    "cx::ExamplePlugin": f"{_PLUGIN_PACKAGE}.example:ExamplePlugin",
    "cx::ExecutivePlugin": f"{_PLUGIN_PACKAGE}.executive:ExecutivePlugin",
    "cx::FileLoadPlugin": f"{_PLUGIN_PACKAGE}.file_load:FileLoadPlugin",
    "cx::ProtobufPlugin": f"{_PLUGIN_PACKAGE}.protobuf:ProtobufPlugin",
    "cx::RosMsgsPlugin": f"{_PLUGIN_PACKAGE}.ros_msgs:RosMsgsPlugin",
    "cx::RosParamPlugin": f"{_PLUGIN_PACKAGE}.ros_param:RosParamPlugin",
    "cx::Tf2PoseTrackerPlugin": f"{_PLUGIN_PACKAGE}.tf2_pose_tracker:Tf2PoseTrackerPlugin",
}

# the classes that replace shipped classes since pull request 33 of carologistics/clips_executive (June 2026)
_CLASSES_SINCE_2026: Final = {
    "cx::ConfigPlugin": f"{_PLUGIN_PACKAGE}.config:QuotedKeyConfigPlugin",
    "cx::ExecutivePlugin": f"{_PLUGIN_PACKAGE}.focus_stack_executive:FocusStackExecutivePlugin",
}


class NodeContext(Struct):
    """The shared state of a node's plug-ins.

    :param run_environment: runs the rules of an environment and returns the number of firings; the node sets
        this function.
    """

    parameters: NodeParameters
    packages: Packages
    clock: Clock
    bus: EventBus
    ros: RosNode
    run_environment: Callable[[StockEnvironment], int] = lambda env: env.run()
    connections: MakeConnections | None = None  # makes protobuf connections; None for sockets
    has_2026_changes: bool = False  # whether the checkout has the changes of pull request 33 (June 2026)
    # whether a command only inspects agents: the command itself loads their files, and no rule fires
    is_inspection: bool = False


class CxPlugin(Feature):
    """The base class of plug-ins.

    :param name: the name of the plug-in in the parameters.
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

    def receive_messages(self) -> None:
        """Receive messages of other nodes; called before and after the ticks of a loop."""

    def tick(self) -> None:
        """Do the work that is due; called once in each loop."""

    def finalize(self) -> None:
        """Release all resources after all environments have unloaded the plug-in."""

    def parameter(self, name: str) -> str:
        """Return the full name of a parameter of the plug-in."""
        return f"{self.name}.{name}"

    def with_false_on_error(
        self, function: Callable[..., Value], log_prefix: str = ""
    ) -> Callable[..., Value]:
        """Wrap a function for rules: the wrapper logs a ClipsError of the function and returns FALSE.

        :param log_prefix: the text before the error in the log.
        """

        def call(*arguments: Value) -> Value:
            try:
                return function(*arguments)
            except ClipsError as error:
                self.log.error(f"{log_prefix}{error}")
                return FALSE

        return call

    def find_share_folders(self) -> list[Path]:
        """Return the share folders of the packages in ``pkg_share_dirs``; log the unknown packages."""
        folders = []
        for package in self.parameters.get_strings(self.parameter("pkg_share_dirs")):
            folder = self.context.packages.find_share_folder(package)
            if folder is None:
                self.log_parameter_error(
                    "pkg_share_dirs",
                    f"names a package that does not exist: {package}",
                    "name a checkout or workspace that has the package with --ros2cx, or source a ROS"
                    " environment",
                )
            else:
                folders.append(folder)
        return folders

    def log_parameter_error(self, name: str, fault: str, hint: str | None = None) -> None:
        self.log.error(str(self.parameters.make_error(self.parameter(name), fault, hint)))


MakePlugin = Callable[[str, NodeContext], CxPlugin]  # creates a plug-in with a name


def read_class_name(plugin: str, parameters: NodeParameters) -> str:
    """Return the C++ class of a plug-in.

    :raises ConfigError: if the parameters name no class.
    """
    parameter = f"{plugin}.plugin"
    class_name = parameters.get(parameter, "")
    if not class_name:
        raise parameters.find_mark(parameter).error(
            f"the plug-in '{plugin}' has no class: there is no parameter '{parameter}'",
            f'write below {plugin}: plugin: "cx::..."',
        )
    return class_name


def find_plugin_maker(plugin: str, class_name: str, context: NodeContext) -> MakePlugin:
    """Return the Python class that stands in for a C++ class, or a function that makes objects of the class.

    :raises ConfigError: if no class stands in for the C++ class.
    """
    shipped_classes = _SHIPPED_CLASSES | (_CLASSES_SINCE_2026 if context.has_2026_changes else {})
    make_plugin: MakePlugin
    if class_name in shipped_classes:
        make_plugin = resolve_name(shipped_classes[class_name])
        return make_plugin
    from importlib.metadata import entry_points  # noqa: PLC0415 - slow, and rarely needed

    external_classes = {entry_point.name: entry_point for entry_point in entry_points(group=PLUGIN_GROUP)}
    if class_name in external_classes:
        make_plugin = external_classes[class_name].load()
        return make_plugin
    # the next modules are imported only if needed: protobuf and ROS types are slow to import
    proto_files = context.packages.find_proto_files(class_name)
    if proto_files:
        return partial(import_module(f"{_PLUGIN_PACKAGE}.protobuf").ProtobufPlugin, proto_files=proto_files)
    if class_name.startswith(GENERATED_CLASS_PREFIX):
        generated = import_module(f"{_PLUGIN_PACKAGE}.generated")
        type_name = generated.find_type(class_name, context)
        if type_name is not None:
            return partial(generated.GeneratedPlugin, type_name=type_name)
    raise context.parameters.make_error(
        f"{plugin}.plugin",
        f"names a class without a stand-in in cxbridge: {class_name}",
        did_you_mean(
            class_name,
            (*_SHIPPED_CLASSES, *external_classes),
            f"write a stand-in for your own plug-in in Python: a subclass of {__name__}.CxPlugin, as the "
            f"entry point '{class_name}' of the group {PLUGIN_GROUP}",
        ),
    )


def locate_error(plugin: str, error: Exception) -> CxbridgeError:
    """Return an error of cxbridge unchanged, any other exception as an error with plug-in, file and line."""
    if isinstance(error, CxbridgeError):
        return error
    frame = extract_tb(error.__traceback__)[-1]
    return CxbridgeError(
        f"the plug-in '{plugin}' failed: {type(error).__name__}: {error}",
        file=frame.filename,
        line=frame.lineno,
    )
