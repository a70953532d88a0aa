"""The settings of nodes in a configuration: in sections such as ``/ros2/node``, and of skill executors.

The settings of a node are the same in each of these places: packages, distribution, transport, and the
keys of the transport. A section may also have keys of its component, and keys of Fawkes' plug-ins of the
same name.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self, TypeVar

from msgspec import Struct

from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.rights import Rights
from cxbridge.run.plugin_settings import PluginSettings
from cxbridge.skiller.board.settings import value_of
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.definitions import DEFAULT_DISTRIBUTION, DISTRIBUTIONS, Definitions
from cxbridge_ros2.fawkes_keys import has_ours, is_ours
from cxbridge_ros2.names import check_topic
from cxbridge_ros2.node import Domain, Node, Report
from cxbridge_ros2.transports import TRANSPORTS
from cxbridge_ros2.transports.environment import default_reach, has_rclpy

if TYPE_CHECKING:
    from cxbridge.config import Configuration

# Settings of a node.
NODE_KEYS: Final = ("packages", "distribution", "transport", "url", "domain", "reach", "namespace")

# Settings that only some transports have.
_TRANSPORTS_WITH: Final = {
    "domain": ("dds", "rclpy", "zenoh"),
    "reach": ("dds",),
    "url": ("rosbridge", "zenoh"),
}

# Default discovery range of the transports that use the environment's range.
_UNSET_REACH: Final = {"dds": "localhost", "rclpy": "subnet"}

_ROS2: Final = "/ros2"
_WITH_SEVERAL_NODES: Final = ("interfaces", "performers")  # sections with a node per key
_WITHOUT_SERVICES: Final = ("clock",)  # sections whose nodes serve no requests

T = TypeVar("T")


class NodeSettings(Struct, frozen=True):
    """The settings of a node.

    :param packages: folders with ROS packages.
    :param distribution: the distribution of the well-known types.
    :param transport: a key of :data:`TRANSPORTS`.
    :param url: the address of the bridge or router; empty for the default.
    :param domain: the domain number; None for the domain of the environment.
    :param reach: the discovery range; None for the range of the environment.
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
    def of(cls, settings: Mapping[str, Any], folder: Path, component: str) -> NodeSettings:
        """Read the settings from a configuration.

        :param folder: the base of relative paths.
        :param component: the configured component, for errors.
        """
        domain = typed(settings, "domain", -1, component)
        namespace = typed(settings, "namespace", "", component)
        transport = typed(settings, "transport", "", component) or _default_transport(settings)
        if transport not in TRANSPORTS:
            raise ConfigError(
                f"{component}: there is no transport '{transport}'",
                hint=did_you_mean(transport, TRANSPORTS, f"there are: {', '.join(TRANSPORTS)}"),
            )
        for key, transports in _TRANSPORTS_WITH.items():
            if key in settings and transport not in transports:
                raise ConfigError(
                    f"{component}: '{key}' goes with the transport {' or '.join(transports)},"
                    f" not with {transport}"
                )
        return cls(
            packages=tuple(folder / str(package) for package in as_list(settings.get("packages", []))),
            distribution=typed(settings, "distribution", _default_distribution(), component),
            transport=transport,
            url=typed(settings, "url", "", component),
            domain=None if domain < 0 else domain,
            reach=typed(settings, "reach", "", component) or None,
            namespace=check_topic(namespace) if namespace else "",
        )

    @property
    def is_local(self) -> bool:
        """Whether only nodes on this machine can reach the node: over DDS with local discovery."""
        unset = _UNSET_REACH.get(self.transport)
        # a configuration of Cyclone DDS may name any interface and peer
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
        # by name, since the packages of a transport are imported only where a node uses them
        make = resolve_name(TRANSPORTS[self.transport])
        domain = Domain(self.domain, self.url, self.reach)
        node: Node = make(re.sub(r"\W", "_", name), definitions, domain, report)
        node.rights = rights
        return node


def _default_transport(settings: Mapping[str, Any]) -> str:
    """Return rclpy in a sourced ROS 2, for its RMW and types; otherwise DDS."""
    excludes_rclpy = any(
        key in settings and "rclpy" not in transports for key, transports in _TRANSPORTS_WITH.items()
    )
    return "dds" if excludes_rclpy or not has_rclpy() else "rclpy"


def _default_distribution() -> str:
    """Return the distribution of the sourced environment if it is known, else the default."""
    sourced = os.environ.get("ROS_DISTRO", "")
    return sourced if sourced in DISTRIBUTIONS else DEFAULT_DISTRIBUTION


# --- values -------------------------------------------------------------------------------------------------


def as_list(value: Any) -> list[Any]:
    """Return a setting that is a list, or a single element without brackets."""
    return value if isinstance(value, list) else [value]


def typed(settings: Mapping[str, Any], name: str, default: T, component: str) -> T:
    """Return a setting of the same type as its default.

    :param component: the configured component, for the error.
    :raises ConfigError: if the setting has another type.
    """
    value = settings.get(name, default)
    # a bool is an int in Python, but true is not a number in a configuration
    if not isinstance(value, type(default)) or isinstance(value, bool) != isinstance(default, bool):
        raise ConfigError(f"{component} needs a {type(default).__name__} as '{name}', not {value!r}")
    return value


def check_keys(settings: Iterable[str], known: Iterable[str], component: str) -> None:
    """Raise `ConfigError` for a key that a component does not read."""
    names = [*known]
    for key in settings:
        if key.split("/")[0] not in names:
            raise ConfigError(
                f"{component} has no setting '{key}'",
                hint=did_you_mean(key, names, f"it has: {', '.join(names)}"),
            )


def nested(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings by path (``skills/goto/name``) as nested mappings.

    :raises ConfigError: if a path is both a value and a mapping.
    """
    tree: dict[str, Any] = {}
    for path, value in settings.items():
        *parents, name = path.split("/")
        mapping = tree
        for parent in parents:
            mapping = mapping.setdefault(parent, {})
            if not isinstance(mapping, dict):
                raise ConfigError(f"'{path}' is below a value that is not a mapping")
        mapping[name] = value
    return tree


# --- sections -----------------------------------------------------------------------------------------------


def section_values(config: Configuration, section: str) -> dict[str, Any]:
    """Return the values below a path by relative path, without those of Fawkes' plug-ins."""
    values: dict[str, Any] = {}
    for value in config.search(f"{section}/"):
        key = value.path.removeprefix(f"{section}/")
        if is_ours(section, key):
            values[key] = [*map(value_of, value.items)] if value.is_list else value_of(value.text)
    return values


def node_settings(
    config: Configuration, section: str, keys: tuple[str, ...], folder: Path, component: str
) -> tuple[dict[str, Any], NodeSettings]:
    """Return the values of a section, and the node settings among them.

    :param keys: the keys of the component, besides those of nodes.
    :param folder: the base of relative paths.
    :param component: the configured component, for errors.
    """
    values = section_values(config, section)
    with located(config, section):
        check_keys(values, (*keys, *NODE_KEYS), component)
        return values, NodeSettings.of(values, folder, component)


@contextmanager
def located(config: Configuration, section: str) -> Iterator[None]:
    """Add file and line of a section to errors about its settings."""
    try:
        yield
    except CxbridgeError as error:
        if error.file is None:
            for value in config.search(f"{section}/"):
                if is_ours(section, value.path.removeprefix(f"{section}/")):
                    error.file, error.line = value.file, value.line
                    break
        raise


class NodesSettings(PluginSettings):
    """The reach of the nodes in a configuration, for the check of rights.

    :param is_local: whether only nodes of this machine can reach them.
    """

    SECTION: ClassVar[str] = _ROS2
    in_runs: ClassVar[bool] = True

    def __init__(self, *, is_local: bool) -> None:
        self._is_local = is_local

    @classmethod
    def read(cls, config: Configuration) -> Self | None:
        if not config.keys(cls.SECTION):
            return None
        return cls(is_local=all(_is_local(config, section) for section in _node_sections(config)))

    @property
    def is_local(self) -> bool:
        return self._is_local


def _node_sections(config: Configuration) -> Iterator[str]:
    """Yield the sections of nodes that serve requests."""
    for name in config.keys(_ROS2):
        section = f"{_ROS2}/{name}"
        if name in _WITH_SEVERAL_NODES:
            yield from (f"{section}/{key}" for key in config.keys(section))
        elif name not in _WITHOUT_SERVICES and has_ours(config, section):
            yield section


def _is_local(config: Configuration, section: str) -> bool:
    values = {key: value for key, value in section_values(config, section).items() if key in NODE_KEYS}
    try:
        return NodeSettings.of(values, Path(), section).is_local
    except CxbridgeError:
        return True  # the component of this section reports the error
