"""The common part of skill executors that are nodes of ROS 2: settings, and joining the domain."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Generator, Mapping
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, ClassVar, Final, TypeVar

from msgspec import Struct

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import ConfigError
from cxbridge.rights import EVERYTHING, Rights
from cxbridge.skiller.board.executor import ExecutorContext, SkillExecutor, SkillFailedError
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.definitions import DEFAULT_DISTRIBUTION, DISTRIBUTIONS, Definitions
from cxbridge_ros2.node import Domain, Node, Report
from cxbridge_ros2.topics import check_topic
from cxbridge_ros2.transports import TRANSPORTS, has_rclpy
from cxbridge_ros2.transports.environment import default_reach

# Settings of a node.
OF_NODE: Final = ("packages", "distribution", "transport", "url", "domain", "reach", "namespace")

TIMEOUT_S: Final = 600.0  # default limit of a skill in seconds

# Settings that only some transports have.
_ONLY: Final = {"domain": ("dds", "rclpy", "zenoh"), "reach": ("dds",), "url": ("rosbridge", "zenoh")}

# Default discovery range of the transports that use the environment's range.
_UNSET_REACH: Final = {"dds": "localhost", "rclpy": "subnet"}

S = TypeVar("S")
T = TypeVar("T")


class NodeSettings(Struct, frozen=True):
    """The settings of a node.

    :param packages: folders with ROS packages.
    :param distribution: the distribution of the well-known types.
    :param transport: a key of :data:`TRANSPORTS`.
    :param url: the address of the bridge or router; empty for the default.
    :param domain: the domain number; None for the environment's.
    :param reach: the discovery range; None for the environment's.
    :param namespace: the prefix of all names; may be empty.
    """

    packages: tuple[Path, ...]
    distribution: str
    transport: str
    url: str
    domain: int | None
    reach: str | None
    namespace: str

    @classmethod
    def of(cls, settings: Mapping[str, Any], folder: Path, whose: str) -> NodeSettings:
        """Read the settings from a configuration.

        :param folder: the base of relative paths.
        :param whose: the configured component, for errors.
        """
        packages = settings.get("packages", [])
        domain = typed(settings, "domain", -1, whose)
        namespace = typed(settings, "namespace", "", whose)
        transport = typed(settings, "transport", "", whose) or _default_transport(settings)
        if transport not in TRANSPORTS:
            hint = did_you_mean(transport, TRANSPORTS, f"there are: {', '.join(TRANSPORTS)}")
            raise ConfigError(f"{whose}: there is no transport '{transport}'", hint=hint)
        for key, only in _ONLY.items():
            if key in settings and transport not in only:
                raise ConfigError(
                    f"{whose}: '{key}' goes with the transport {' or '.join(only)}, not with {transport}"
                )
        return cls(
            packages=tuple(
                folder / str(each) for each in (packages if isinstance(packages, list) else [packages])
            ),
            distribution=typed(settings, "distribution", _default_distribution(), whose),
            transport=transport,
            url=typed(settings, "url", "", whose),
            domain=None if domain < 0 else domain,
            reach=typed(settings, "reach", "", whose) or None,
            namespace=check_topic(namespace) if namespace else "",
        )

    @property
    def stays_here(self) -> bool:
        """Whether only nodes on this machine can reach the node: over DDS with local discovery."""
        unset = _UNSET_REACH.get(self.transport)
        if unset is None or os.environ.get("CYCLONEDDS_URI"):
            return False
        return (self.reach or default_reach(unset)) in ("localhost", "off")

    def definitions(self, texts: Mapping[str, str] | None = None) -> Definitions:
        return Definitions(self.packages, self.distribution, texts=texts)

    def join(self, name: str, definitions: Definitions, report: Report | None, rights: Rights) -> Node:
        """Join the domain.

        :param name: the name of the node; invalid characters are replaced.
        :param report: called with complaints about other nodes; None turns them into Python warnings.
        :param rights: the rights of other nodes.
        :raises Ros2Error: if the domain cannot be joined.
        """
        make = resolve_name(TRANSPORTS[self.transport])
        domain = Domain(self.domain, self.url, self.reach)
        node: Node = make(re.sub(r"\W", "_", name), definitions, domain, report)
        node.rights = rights
        return node


def _default_transport(settings: Mapping[str, Any]) -> str:
    """Return rclpy in a sourced ROS 2, for its RMW and types; otherwise DDS."""
    wants_another = any(key in settings and "rclpy" not in only for key, only in _ONLY.items())
    return "dds" if wants_another or not has_rclpy() else "rclpy"


def _default_distribution() -> str:
    """Return the distribution of the sourced environment if it is known, else the default."""
    sourced = os.environ.get("ROS_DISTRO", "")
    return sourced if sourced in DISTRIBUTIONS else DEFAULT_DISTRIBUTION


class RosExecutor(SkillExecutor):
    """Executes skills as a node of ROS 2. Settings may be nested mappings."""

    known_settings: ClassVar[tuple[str, ...]] = (*OF_NODE, "skills")

    def __init__(self, context: ExecutorContext) -> None:
        settings = nested(context.settings)
        super().__init__(
            ExecutorContext(
                context.agent, context.board, context.clock, context.log, settings, context.folder
            )
        )
        self.node_settings = NodeSettings.of(settings, self.folder, type(self).__name__)
        self._definitions = self.node_settings.definitions()
        self._node: Node | None = None

    def join(self) -> Node:
        """Join the domain; :meth:`close` leaves it."""
        self._node = node = self.node_settings.join(
            f"cxbridge_{self.agent}", self._definitions, self.log.warn, EVERYTHING
        )
        return node

    def idle(self) -> None:
        self.poll()

    def poll(self) -> None:
        if self._node is not None:
            self._node.poll()

    def close(self) -> None:
        if self._node is not None:
            self._node.close()

    def within(self, seconds: float, name: str, steps: Generator[S, None, Any]) -> Generator[S, None, Any]:
        """Yield the steps of a generator and return its value.

        :param name: the subject of the error after the limit.
        :raises SkillFailedError: after the limit.
        """
        deadline_us = self.clock.now_us() + round(seconds * MICROSECONDS)
        try:
            while True:
                try:
                    step = next(steps)
                except StopIteration as end:
                    return end.value
                if self.clock.now_us() > deadline_us:
                    raise SkillFailedError(f"{name} has not ended within {seconds:g} s")
                yield step
        finally:
            steps.close()


def typed(settings: Mapping[str, Any], name: str, default: T, whose: str) -> T:
    """Return a setting of the same type as its default.

    :param whose: the configured component, for the error.
    :raises ConfigError: if the setting has another type.
    """
    value = settings.get(name, default)
    if not isinstance(value, type(default)) or isinstance(value, bool) != isinstance(default, bool):
        raise ConfigError(f"{whose} needs a {type(default).__name__} as '{name}', not {value!r}")
    return value


def seconds_of(skill: str, key: str, value: Any) -> float:
    """Return a skill's setting in seconds.

    :raises ConfigError: if the value is not a positive number.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
        raise ConfigError(f"the {key} of the skill {skill} is a number of seconds, not {value!r}")
    return float(value)


def nested(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings by path (``skills/goto/name``) as nested mappings.

    :raises ConfigError: if a path is both a value and a mapping.
    """
    tree: dict[str, Any] = {}
    for path, value in settings.items():
        *parents, last = path.split("/")
        mapping = tree
        for parent in parents:
            inner = mapping.setdefault(parent, {})
            if not isinstance(inner, dict):
                raise ConfigError(f"'{path}' is in something that is not a mapping")
            mapping = inner
        mapping[last] = value
    return tree
