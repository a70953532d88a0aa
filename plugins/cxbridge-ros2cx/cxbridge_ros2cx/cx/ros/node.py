"""The node's connection to ROS: process-local on a virtual clock, a transport such as DDS on a real one."""

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

_PDDL: Final = "/pddl_manager/"
# types that neither the checkout nor rosbags has: bonds, and the types of the examples
_TYPES: Final = {
    "bond/msg/Status": "std_msgs/Header header\nstring id\nstring instance_id\nbool active\n"
    "float32 heartbeat_timeout\nfloat32 heartbeat_period\n",
    "example_interfaces/action/Fibonacci": "int32 order\n---\nint32[] sequence\n---\nint32[] sequence\n",
    "turtlesim/msg/Pose": "".join(
        f"float32 {name}\n" for name in ("x", "y", "theta", "linear_velocity", "angular_velocity")
    ),
    "turtlesim/srv/TeleportAbsolute": "float32 x\nfloat32 y\nfloat32 theta\n---\n",
}


class RosNode(Closing):
    """The node, which joins ROS when a plug-in first needs it.

    :param name: the full name: ``/clips_manager``.
    :param packages: the packages that are searched for types first.
    """

    def __init__(
        self, name: str, packages: Packages, clock: Clock, log_of: Callable[[str], Logger], rights: Rights
    ) -> None:
        self.name = name
        self._packages, self._clock, self._rights = packages, clock, rights
        self._log_of, self._log = log_of, log_of(name.rpartition("/")[2])
        self._pddl: PddlManager | None = None
        self._namespace = name.rpartition("/")[0]
        # Request numbers, counted over all clients: the RMW of the recordings counts the same way.
        self.requests = count(1)

    @cached_property
    def definitions(self) -> Definitions:
        from cxbridge_ros2.definitions import Definitions  # noqa: PLC0415 - slow to import, only for agents with ROS

        return Definitions(self._packages.folders, texts=_TYPES)

    @cached_property
    def messages(self) -> MessageTable:
        from cxbridge_ros2cx.cx.ros.messages import MessageTable  # noqa: PLC0415 - likewise

        return MessageTable(self.definitions)

    @cached_property
    def graph(self) -> LocalGraph:
        """The nodes of this process on a virtual clock; peers join here."""
        from cxbridge_ros2.transports.local import LocalGraph  # noqa: PLC0415 - likewise

        return LocalGraph(self.definitions)

    @cached_property
    def node(self) -> Node:
        name = self.name.rpartition("/")[2]
        if self._clock.is_virtual:
            return self.graph.join(name, self._log.warn)
        from cxbridge_ros2.settings import NodeSettings  # noqa: PLC0415 - likewise

        settings = NodeSettings.parse({}, self._folder, "the node")
        return settings.join(name, self.definitions, self._log.warn, self._rights)

    @property
    def _folder(self) -> Path:
        return self._packages.folders[0] if self._packages.folders else Path()

    def reach(self, name: str, kind: TypeName) -> str:
        """Return the full name of a service or an action, for a new client.

        On a virtual clock cxbridge's own ``pddl_manager`` joins for the first client of its services, with
        the types of the client's package.
        """
        full_name = self.full_name(name)
        if self._clock.is_virtual and self._pddl is None and full_name.startswith(_PDDL):
            from cxbridge_ros2cx.cx.pddl.manager import PddlManager  # noqa: PLC0415 - for agents that plan

            log = self._log_of(_PDDL.strip("/"))
            self._pddl = PddlManager(
                self.graph.join("pddl_manager", log.warn), self._clock, log, kind.package
            )
        return full_name

    def full_name(self, name: str) -> str:
        """Return the full name of a topic, a service or an action."""
        if name.startswith("~/"):
            return f"{self.name}/{name[2:]}"
        return name if name.startswith("/") else f"{self._namespace}/{name}"

    @property
    def has_peers(self) -> bool:
        """Whether other nodes exist: on a virtual clock, other nodes of this process."""
        if not self._clock.is_virtual:
            return True
        own_nodes = {self.name.rpartition("/")[2], _PDDL.strip("/")}
        return "graph" in self.__dict__ and not own_nodes.issuperset(self.graph.nodes)

    def spin(self) -> None:
        """Receive messages; on a virtual clock also all messages that these cause at this moment."""
        if self._pddl is not None:
            self._pddl.step()
        # __dict__ tells whether the cached property exists; its use would create it
        if "graph" in self.__dict__:
            if not self.graph.settle():
                self._log.error("messages answer each other without an end")
        elif "node" in self.__dict__:
            self.node.poll()

    def close(self) -> None:
        if self._pddl is not None:
            self._pddl.close()
        if "node" in self.__dict__:
            self.node.close()
