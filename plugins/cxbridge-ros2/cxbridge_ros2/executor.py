"""What executors of skills that are nodes of ROS 2 have in common: their settings, and how they join."""

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

OF_NODE: Final = ("packages", "distribution", "transport", "url", "domain", "reach", "namespace")
"""The settings of a node."""

TIMEOUT_S: Final = 600.0
"""Seconds that a skill may take."""

_ONLY: Final = {"domain": ("dds", "rclpy", "zenoh"), "reach": ("dds",), "url": ("rosbridge", "zenoh")}
"""The transports that settings go with that not all have."""

_UNSET_REACH: Final = {"dds": "localhost", "rclpy": "subnet"}
"""How far the transports that the environment's range applies to look for nodes without it."""

S = TypeVar("S")
T = TypeVar("T")


class NodeSettings(Struct, frozen=True):
    """Where a node of ours is, and the types that it knows.

    :param packages: folders with ROS packages.
    :param distribution: whose well-known types are known.
    :param transport: a key of :data:`TRANSPORTS`.
    :param url: where the bridge or the router is; empty: where it is by default.
    :param domain: the number of the domain; None: that of the environment.
    :param reach: how far discovery goes; None: that of the environment.
    :param namespace: the prefix of all names; empty: none.
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
        """Read the settings of a configuration.

        :param folder: the base of relative folders.
        :param whose: the configured component, for errors.
        :raises CxbridgeError: when they are invalid.
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
        """Whether only nodes of this machine reach the node: over DDS with discovery on this host."""
        unset = _UNSET_REACH.get(self.transport)
        if unset is None or os.environ.get("CYCLONEDDS_URI"):
            return False
        return (self.reach or default_reach(unset)) in ("localhost", "off")

    def definitions(self, texts: Mapping[str, str] | None = None) -> Definitions:
        """Read which types there are.

        :param texts: more definitions, by their types.
        :raises Ros2Error: when a folder does not exist.
        """
        return Definitions(self.packages, self.distribution, texts=texts)

    def join(self, name: str, definitions: Definitions, report: Report | None, rights: Rights) -> Node:
        """Join the domain.

        :param name: of the node; what ROS does not take in names is replaced.
        :param report: gets complaints about other nodes; None: they become Python warnings.
        :param rights: what other nodes may do over it.
        :raises Ros2Error: when that is not possible.
        """
        make = resolve_name(TRANSPORTS[self.transport])
        domain = Domain(self.domain, self.url, self.reach)
        node: Node = make(re.sub(r"\W", "_", name), definitions, domain, report)
        node.rights = rights
        return node


def _default_transport(settings: Mapping[str, Any]) -> str:
    """Return rclpy where a ROS 2 is sourced, for its RMW and its types; DDS elsewhere."""
    wants_another = any(key in settings and "rclpy" not in only for key, only in _ONLY.items())
    return "dds" if wants_another or not has_rclpy() else "rclpy"


def _default_distribution() -> str:
    """Return the distribution of the sourced environment, if it is a known one; else a common one."""
    sourced = os.environ.get("ROS_DISTRO", "")
    return sourced if sourced in DISTRIBUTIONS else DEFAULT_DISTRIBUTION


class RosExecutor(SkillExecutor):
    """Executes skills as a node of ROS 2. Settings may be mappings in mappings."""

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
        """Handle incoming messages."""
        self.poll()

    def poll(self) -> None:
        """Handle incoming messages."""
        if self._node is not None:
            self._node.poll()

    def close(self) -> None:
        """Leave the domain."""
        if self._node is not None:
            self._node.close()

    def within(self, seconds: float, name: str, steps: Generator[S, None, Any]) -> Generator[S, None, Any]:
        """Yield the steps of a generator and return its value, unless it takes too long.

        :param name: what takes that long.
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
    """Return a setting, which has the type of its default.

    :param whose: the configured component, for the error.
    :raises ConfigError: when it has another type.
    """
    value = settings.get(name, default)
    if not isinstance(value, type(default)) or isinstance(value, bool) != isinstance(default, bool):
        raise ConfigError(f"{whose} needs a {type(default).__name__} as '{name}', not {value!r}")
    return value


def seconds_of(skill: str, key: str, value: Any) -> float:
    """Return a number of seconds that a skill is configured with.

    :raises ConfigError: when it is none.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
        raise ConfigError(f"the {key} of the skill {skill} is a number of seconds, not {value!r}")
    return float(value)


def nested(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings as mappings in mappings; a configuration gives them by path: ``skills/goto/name``.

    :raises ConfigError: when something is both a value and a mapping.
    """
    found: dict[str, Any] = {}
    for path, value in settings.items():
        *parents, last = path.split("/")
        place = found
        for parent in parents:
            inner = place.setdefault(parent, {})
            if not isinstance(inner, dict):
                raise ConfigError(f"'{path}' is in something that is not a mapping")
            place = inner
        place[last] = value
    return found
