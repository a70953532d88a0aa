"""The node's connection to ROS.

On a virtual clock the node and its peers exchange messages within the process, on a real clock over a
transport such as DDS. The connection begins when a plug-in first needs it.
"""

from __future__ import annotations

from functools import cached_property
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.closing import Closing

if TYPE_CHECKING:
    from collections.abc import Callable

    from cxbridge.clock import Clock
    from cxbridge.events import Logger
    from cxbridge.rights import Rights
    from cxbridge_ros2.definitions import Definitions
    from cxbridge_ros2.names import TypeName
    from cxbridge_ros2.node import Node
    from cxbridge_ros2.transports.local import LocalGraph
    from cxbridge_ros2cx.cx.packages import Packages
    from cxbridge_ros2cx.cx.pddl.manager import PddlManager
    from cxbridge_ros2cx.cx.ros.messages import MessageTable

_PDDL_NAMESPACE: Final = "/pddl_manager/"
# definitions that neither a checkout nor rosbags has: of bonds, and of types in the examples of the ROS 2 CX
_EXTRA_DEFINITIONS: Final = {
    "bond/msg/Status": "std_msgs/Header header\nstring id\nstring instance_id\nbool active\n"
    "float32 heartbeat_timeout\nfloat32 heartbeat_period\n",
    "example_interfaces/action/Fibonacci": "int32 order\n---\nint32[] sequence\n---\nint32[] sequence\n",
    "turtlesim/msg/Pose": "".join(
        f"float32 {name}\n" for name in ("x", "y", "theta", "linear_velocity", "angular_velocity")
    ),
    "turtlesim/srv/TeleportAbsolute": "float32 x\nfloat32 y\nfloat32 theta\n---\n",
}


class RosNode(Closing):
    """The node of the clips_manager, in the place of its ROS node.

    :param name: the full name, e.g. ``/clips_manager``.
    :param packages: the packages whose types hide types of the same name in rosbags.
    """

    def __init__(
        self,
        name: str,
        packages: Packages,
        clock: Clock,
        make_logger: Callable[[str], Logger],
        rights: Rights,
    ) -> None:
        self.name = name
        self._namespace, _, self._short_name = name.rpartition("/")
        self._packages, self._clock, self._rights = packages, clock, rights
        self._make_logger, self._log = make_logger, make_logger(self._short_name)
        self._pddl_manager: PddlManager | None = None
        # Numbers of requests, over all clients: the ROS middleware of the recorded runs counts the same way.
        self.request_numbers = count(1)

    @cached_property
    def definitions(self) -> Definitions:
        from cxbridge_ros2.definitions import Definitions  # noqa: PLC0415 - slow to import, only for agents with ROS

        return Definitions(self._packages.definition_folders, texts=_EXTRA_DEFINITIONS)

    @cached_property
    def messages(self) -> MessageTable:
        from cxbridge_ros2cx.cx.ros.messages import MessageTable  # noqa: PLC0415 - likewise

        return MessageTable(self.definitions)

    @cached_property
    def graph(self) -> LocalGraph:
        """The graph of the nodes in this process, for a virtual clock; peers join the same graph."""
        from cxbridge_ros2.transports.local import LocalGraph  # noqa: PLC0415 - likewise

        return LocalGraph(self.definitions)

    @cached_property
    def node(self) -> Node:
        if self._clock.is_virtual:
            return self.graph.join(self._short_name, self._log.warn)
        from cxbridge_ros2.settings import NodeSettings  # noqa: PLC0415 - likewise

        base_folder = next(iter(self._packages.definition_folders), Path())
        return NodeSettings.parse({}, base_folder, "the node").join(
            self._short_name, self.definitions, self._log.warn, self._rights
        )

    def prepare_client(self, name: str, type_name: TypeName) -> str:
        """Return the full name of a service or an action for a new client, and start the server if necessary.

        On a virtual clock cxbridge's own node ``pddl_manager`` joins the graph for the first client of its
        services. The node uses the types of that client's package.
        """
        full_name = self.full_name(name)
        if self._clock.is_virtual and self._pddl_manager is None and full_name.startswith(_PDDL_NAMESPACE):
            from cxbridge_ros2cx.cx.pddl.manager import PddlManager  # noqa: PLC0415 - for agents that plan

            log = self._make_logger(_PDDL_NAMESPACE.strip("/"))
            self._pddl_manager = PddlManager(
                self.graph.join("pddl_manager", log.warn), self._clock, log, type_name.package
            )
        return full_name

    def full_name(self, name: str) -> str:
        """Return the full name of a topic, a service or an action."""
        if name.startswith("~/"):
            return f"{self.name}/{name.removeprefix('~/')}"
        return name if name.startswith("/") else f"{self._namespace}/{name}"

    @property
    def has_peers(self) -> bool:
        """Whether there may be other nodes: on a virtual clock, other nodes of this process."""
        if not self._clock.is_virtual:
            return True
        own_nodes = {self._short_name, _PDDL_NAMESPACE.strip("/")}
        # a look into __dict__, here and below, since access to the cached property would create the graph
        return "graph" in self.__dict__ and not own_nodes.issuperset(self.graph.node_names)

    def spin(self) -> None:
        """Receive messages; on a virtual clock also the messages that peers send in response."""
        if self._pddl_manager is not None:
            self._pddl_manager.plan_waiting_goals()
        if "graph" in self.__dict__:
            if not self.graph.settle():
                self._log.error("nodes respond to each other's messages without end")
        elif "node" in self.__dict__:
            self.node.poll()

    def close(self) -> None:
        if self._pddl_manager is not None:
            self._pddl_manager.close()
        if "node" in self.__dict__:
            self.node.close()
