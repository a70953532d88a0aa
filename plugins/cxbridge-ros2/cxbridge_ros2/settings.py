"""The settings of nodes in a configuration: in sections such as ``/ros2/node``, and of skill executors.

The settings of a node are the same in each place: packages, distribution, transport, and the keys of the
transport. A section may also have keys of its component, and keys of a Fawkes plug-in of the same name.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self, TypeVar

from msgspec import Struct

from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.rights import Rights
from cxbridge.run.plugin_settings import PluginSettings
from cxbridge.skiller.board.settings import parse_value
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.definitions import DEFAULT_DISTRIBUTION, DISTRIBUTIONS, Definitions
from cxbridge_ros2.fawkes_keys import has_cxbridge_keys, is_cxbridge_key
from cxbridge_ros2.names import check_ros_name
from cxbridge_ros2.node import Node, ProblemCallback
from cxbridge_ros2.transports import TRANSPORTS
from cxbridge_ros2.transports.environment import has_rclpy, read_discovery_range

if TYPE_CHECKING:
    from cxbridge.config import Configuration, ConfigValue

# Settings of a node.
NODE_KEYS: Final = ("packages", "distribution", "transport", "url", "domain", "reach", "namespace")

# Settings that only some of the transports have.
_TRANSPORT_KEYS: Final = ("domain", "reach", "url")

# Discovery ranges of transports where neither the settings nor the environment name a range. rclpy has the
# default of ROS.
_DEFAULT_REACHES: Final = {"dds": "localhost", "rclpy": "subnet"}

_ROS2_SECTION: Final = "/ros2"
_MULTI_NODE_SECTIONS: Final = ("interfaces", "performers")  # sections with a node per key
# Sections whose nodes only follow the time: other nodes need no rights there.
_CLOCK_SECTIONS: Final = ("clock",)

SettingT = TypeVar("SettingT")


class NodeSettings(Struct, frozen=True):
    """The settings of a node.

    :param packages: folders with ROS packages.
    :param distribution: the distribution of the well-known types.
    :param transport: a key of :data:`TRANSPORTS`.
    :param url: the address of the bridge; None for the default.
    :param domain: the domain number; None for the domain of the environment.
    :param reach: the discovery range; None for the range of the environment.
    :param namespace: the prefix of all names; may be empty.
    """

    packages: tuple[Path, ...]
    distribution: str
    transport: str
    url: str | None
    domain: int | None
    reach: str | None
    namespace: str

    @classmethod
    def parse(cls, settings: Mapping[str, Any], folder: Path, subject: str) -> NodeSettings:
        """Parse the settings of a node.

        :param settings: values by key; keys that are not in :data:`NODE_KEYS` are ignored.
        :param folder: the base of relative paths.
        :param subject: the configured thing as the subject of an error text, such as ``the topic X``.
        :raises ConfigError: if the transport is unknown, or a setting has a wrong type or does not belong to
            the transport.
        :raises Ros2Error: if the namespace is not an absolute name.
        """
        domain = typed_setting(settings, "domain", -1, subject)
        namespace = typed_setting(settings, "namespace", "", subject)
        transport = typed_setting(settings, "transport", "", subject) or _find_default_transport(settings)
        check_choice(transport, TRANSPORTS, f"{subject}: there is no transport '{transport}'")
        for key in _TRANSPORT_KEYS:
            if key in settings and key not in TRANSPORTS[transport].keys:
                owners = [name for name, owner in TRANSPORTS.items() if key in owner.keys]
                raise ConfigError(
                    f"{subject}: '{key}' belongs to the transport {' or '.join(owners)}, not to {transport}"
                )
        # -1 stands for a missing domain, since `typed_setting` takes the type from the default
        return cls(
            packages=tuple(folder / str(package) for package in to_list(settings.get("packages", []))),
            distribution=typed_setting(settings, "distribution", _find_default_distribution(), subject),
            transport=transport,
            url=typed_setting(settings, "url", "", subject) or None,
            domain=None if domain < 0 else domain,
            reach=typed_setting(settings, "reach", "", subject) or None,
            namespace=check_ros_name(namespace) if namespace else "",
        )

    @property
    def is_local(self) -> bool:
        """Whether only nodes on this machine can reach the node. Nodes of a rosbridge are never local."""
        default_reach = _DEFAULT_REACHES.get(self.transport)
        # a configuration of Cyclone DDS may name any interface and peer
        if default_reach is None or os.environ.get("CYCLONEDDS_URI"):
            return False
        return (self.reach or read_discovery_range(default_reach)) in ("localhost", "off")

    def load_definitions(self, texts: Mapping[str, str] | None = None) -> Definitions:
        return Definitions(self.packages, self.distribution, texts=texts)

    def join(
        self, name: str, definitions: Definitions, report: ProblemCallback | None, rights: Rights
    ) -> Node:
        """Join the domain.

        :param name: the name of the node; invalid characters are replaced.
        :param report: called with complaints about other nodes; None turns complaints into Python warnings.
        :param rights: the rights of other nodes.
        :raises Ros2Error: if the domain cannot be joined.
        """
        # by name, since the packages of a transport are imported only where a node uses them
        transport = TRANSPORTS[self.transport]
        node_class: Callable[..., Node] = resolve_name(transport.node_class)
        arguments = {key: getattr(self, key) for key in transport.keys}
        node = node_class(re.sub(r"\W", "_", name), definitions, report=report, **arguments)
        node.rights = rights  # not an argument, since the transports do not check rights
        return node


def _find_default_transport(settings: Mapping[str, Any]) -> str:
    """Return rclpy in a sourced ROS 2, so that its RMW and types are used; otherwise DDS.

    DDS is also the default for settings that rclpy does not have.
    """
    excludes_rclpy = any(key in settings and key not in TRANSPORTS["rclpy"].keys for key in _TRANSPORT_KEYS)
    return "dds" if excludes_rclpy or not has_rclpy() else "rclpy"


def _find_default_distribution() -> str:
    """Return the distribution of the sourced environment if rosbags knows it, or else the default."""
    sourced_distribution = os.environ.get("ROS_DISTRO", "")
    return sourced_distribution if sourced_distribution in DISTRIBUTIONS else DEFAULT_DISTRIBUTION


# --- values -------------------------------------------------------------------------------------------------


def to_list(setting: Any) -> list[Any]:
    """Return a setting as a list; a setting that is not a list becomes the only element."""
    return setting if isinstance(setting, list) else [setting]


def settings_by_name(setting: Any) -> Mapping[str, Any]:
    """Return the settings of named things by name; a list of names stands for things without settings."""
    return setting if isinstance(setting, Mapping) else {str(name): {} for name in to_list(setting)}


def typed_setting(settings: Mapping[str, Any], name: str, default: SettingT, subject: str) -> SettingT:
    """Return a setting, which must have the type of the default; the default if the setting is missing.

    :param subject: the configured thing as the subject of the error text.
    :raises ConfigError: if the setting has another type.
    """
    value = settings.get(name, default)
    # a bool is an int in Python, but true is not a number in a configuration
    if not isinstance(value, type(default)) or isinstance(value, bool) != isinstance(default, bool):
        raise ConfigError(f"{subject} needs a {type(default).__name__} as '{name}', not {value!r}")
    return value


def check_keys(settings: object, known_keys: Iterable[str], subject: str) -> None:
    """Raise `ConfigError` for an unknown key, or for settings that are not a mapping.

    :param subject: the configured thing as the subject of the error text.
    """
    if not isinstance(settings, Mapping):
        raise ConfigError(f"the settings of {subject} must be a mapping, not {settings!r}")
    names = [*known_keys]
    for key in settings:  # a key may be a path, such as skills/goto/name
        check_choice(key.partition("/")[0], names, f"{subject} has no setting '{key}'")


def check_choice(name: str, choices: Collection[str], problem: str) -> None:
    """Raise `ConfigError` with a hint for a name that is not one of the choices.

    :param problem: the message of the error.
    """
    if name not in choices:
        hint = did_you_mean(name, choices, f"there are: {', '.join(choices) or 'none'}")
        raise ConfigError(problem, hint=hint)


def nest_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Convert settings by path, such as ``skills/goto/name``, to nested mappings.

    :raises ConfigError: if a path is below the path of an earlier value.
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


def read_section(config: Configuration, section: str) -> dict[str, Any]:
    """Return the values of a section by relative path, without those of Fawkes' plug-ins."""
    return {
        key: [*map(parse_value, value.items)] if value.is_list else parse_value(value.text)
        for key, value in _search_section(config, section)
    }


def _search_section(config: Configuration, section: str) -> Iterator[tuple[str, ConfigValue]]:
    for value in config.search(f"{section}/"):
        key = value.path.removeprefix(f"{section}/")
        if is_cxbridge_key(section, key):
            yield key, value


def read_node_section(
    config: Configuration, section: str, keys: tuple[str, ...], folder: Path, subject: str
) -> tuple[dict[str, Any], NodeSettings]:
    """Return the values of a section by key, and the settings of its node.

    :param keys: the known keys, besides those of nodes.
    :param folder: the base of relative paths.
    :param subject: the configured thing as the subject of an error text, such as ``the topic X``.
    """
    values = read_section(config, section)
    with locate_errors(config, section):
        check_keys(values, (*keys, *NODE_KEYS), subject)
        return values, NodeSettings.parse(values, folder, subject)


@contextmanager
def locate_errors(config: Configuration, section: str) -> Iterator[None]:
    """Add the file and line of a section to errors of the ``with`` block that do not name a file."""
    try:
        yield
    except CxbridgeError as error:
        place = next((value for _, value in _search_section(config, section)), None)
        if error.file is None and place is not None:
            error.file, error.line = place.file, place.line
        raise


class Ros2Reach(PluginSettings):
    """The reach of the nodes in a configuration, for the check of its rights."""

    SECTION: ClassVar[str] = _ROS2_SECTION
    in_runs: ClassVar[bool] = True

    def __init__(self, config: Configuration) -> None:
        self._config = config

    @classmethod
    def read(cls, config: Configuration) -> Self:
        return cls(config)

    @property
    def is_local(self) -> bool:
        sections = _list_node_sections(self._config)
        return all(_is_local_section(self._config, section) for section in sections)


def _list_node_sections(config: Configuration) -> Iterator[str]:
    """Yield the sections of the nodes at which other nodes need rights."""
    for name in config.keys(_ROS2_SECTION):
        section = f"{_ROS2_SECTION}/{name}"
        if name in _MULTI_NODE_SECTIONS:
            yield from (f"{section}/{key}" for key in config.keys(section))
        elif name not in _CLOCK_SECTIONS and has_cxbridge_keys(config, section):
            yield section


def _is_local_section(config: Configuration, section: str) -> bool:
    values = {key: value for key, value in read_section(config, section).items() if key in NODE_KEYS}
    try:
        return NodeSettings.parse(values, Path(), section).is_local
    except CxbridgeError:
        return True  # the component of this section reports the error
