"""The node in ROS: nodes of this process on a virtual clock, DDS or another transport on a real one."""

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
_TYPES: Final = {
    "bond/msg/Status": "std_msgs/Header header\nstring id\nstring instance_id\nbool active\n"
    "float32 heartbeat_timeout\nfloat32 heartbeat_period\n",
    "example_interfaces/action/Fibonacci": "int32 order\n---\nint32[] sequence\n---\nint32[] sequence\n",
    "turtlesim/msg/Pose": "".join(
        f"float32 {name}\n" for name in ("x", "y", "theta", "linear_velocity", "angular_velocity")
    ),
    "turtlesim/srv/TeleportAbsolute": "float32 x\nfloat32 y\nfloat32 theta\n---\n",
}
"""Types that neither the checkout nor rosbags has: of bonds, and of the examples."""


class RosNode(Closing):
    """The node, joined when a plug-in needs ROS for the first time.

    :param name: the whole name: ``/clips_manager``.
    :param packages: where types are looked for first.
    :param rights: the rights of other nodes.
    """

    def __init__(
        self, name: str, packages: Packages, clock: Clock, log_of: Callable[[str], Logger], rights: Rights
    ) -> None:
        self.name = name
        self._packages, self._clock, self._rights = packages, clock, rights
        self._log_of, self._log = log_of, log_of(name.rpartition("/")[2])
        self._pddl: PddlManager | None = None
        self._namespace = name.rpartition("/")[0]
        self.requests = count(1)
        """The numbers of requests, of all clients: the RMW of the recordings counts so."""

    @cached_property
    def definitions(self) -> Definitions:
        """The types that are known."""
        from cxbridge_ros2.definitions import Definitions  # noqa: PLC0415 - only agents with ROS pay

        return Definitions(self._packages.folders, texts=_TYPES)

    @cached_property
    def messages(self) -> MessageTable:
        """The messages that rules have."""
        from cxbridge_ros2cx.cx.ros.messages import MessageTable  # noqa: PLC0415 - likewise

        return MessageTable(self.definitions)

    @cached_property
    def graph(self) -> LocalGraph:
        """The nodes of this process, on a virtual clock; peers join here."""
        from cxbridge_ros2.transports.local import LocalGraph  # noqa: PLC0415 - likewise

        return LocalGraph(self.definitions)

    @cached_property
    def node(self) -> Node:
        """The node of a transport.

        :raises Ros2Error: when it cannot join.
        """
        name = self.name.rpartition("/")[2]
        if self._clock.is_virtual:
            return self.graph.join(name, self._log.warn)
        from cxbridge_ros2.executor import NodeSettings  # noqa: PLC0415 - likewise

        settings = NodeSettings.of({}, self._folder, "the node")
        return settings.join(name, self.definitions, self._log.warn, self._rights)

    @property
    def _folder(self) -> Path:
        return self._packages.folders[0] if self._packages.folders else Path()

    def reach(self, name: str, kind: TypeName) -> str:
        """Return the whole name of a service or an action that has clients.

        On a virtual clock our own ``pddl_manager`` joins when its services have clients, with types of the
        clients' package.
        """
        whole = self.whole(name)
        if self._clock.is_virtual and self._pddl is None and whole.startswith(_PDDL):
            from cxbridge_ros2cx.cx.pddl.manager import PddlManager  # noqa: PLC0415 - for agents that plan

            log = self._log_of(_PDDL.strip("/"))
            self._pddl = PddlManager(
                self.graph.join("pddl_manager", log.warn), self._clock, log, kind.package
            )
        return whole

    def whole(self, name: str) -> str:
        """Return the whole name of a topic, a service or an action."""
        if name.startswith("~/"):
            return f"{self.name}/{name[2:]}"
        return name if name.startswith("/") else f"{self._namespace}/{name}"

    @property
    def has_peers(self) -> bool:
        """Whether peers may reach the node: on a virtual clock the nodes of this process."""
        if not self._clock.is_virtual:
            return True
        own = {self.name.rpartition("/")[2], _PDDL.strip("/")}
        return "graph" in self.__dict__ and not own.issuperset(self.graph.nodes)

    def spin(self) -> None:
        """Take messages, and on a virtual clock all messages that follow at this moment."""
        if self._pddl is not None:
            self._pddl.step()
        if "graph" in self.__dict__:
            if not self.graph.settle():
                self._log.error("messages answer each other without an end")
        elif "node" in self.__dict__:
            self.node.poll()

    def close(self) -> None:
        """Leave."""
        if self._pddl is not None:
            self._pddl.close()
        if "node" in self.__dict__:
            self.node.close()
