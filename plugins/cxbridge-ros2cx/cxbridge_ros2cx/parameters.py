"""The parameter files of the thesis' executive, ros2-clips-executive (2021), as the configuration of a run.

A ROS parameter file has ``NODE: ros__parameters: ...``. The parameters of the node ``clips_executive`` become
the tree ``/clips-executive``; the parameters of the node ``clips_features_manager`` list the features.
"""

from __future__ import annotations

import re
from pathlib import Path

from msgspec import Struct

from cxbridge.clock import MICROSECONDS
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError

EXECUTIVE_NODE = "clips_executive"
FEATURES_NODE = "clips_features_manager"
EXECUTIVE_FILE = "clips_executive.yaml"
FEATURES_FILE = "cx_params.yaml"

EXECUTIVE_TREE = "/clips-executive"  # tree of the executive's parameters in a run, as in Fawkes

REFRESH_RATE_PATH = f"{EXECUTIVE_TREE}/refresh-rate"  # rate of the executive's rules in Hz

_DEFAULT_REFRESH_HZ = 10  # the default of the thesis' executive
_MAX_REFRESH_HZ = 10_000  # far above useful rates: a typing error such as 1e6 would only load the processor

# scalars of YAML 1.1, which the parsers of ROS 2 and of the thesis' executive read; booleans in lower case
YAML_TRUE = frozenset({"y", "yes", "true", "on"})
YAML_FALSE = frozenset({"n", "no", "false", "off"})
YAML_INTEGER = re.compile(r"[+-]?(0[xX][0-9a-fA-F]+|\d+)\Z")


class FeatureEntry(Struct, frozen=True):
    """A feature of the file ``cx_params.yaml``.

    :param name: the name by which rules request the feature.
    :param plugin: the C++ class of the feature, e.g. ``cx::Plansys2Feature``.
    :param file: the file that names the plugin; None if unknown.
    :param line: the line in the file; None if unknown.
    """

    name: str
    plugin: str
    file: str | None = None
    line: int | None = None


def load_executive_parameters(folder: Path) -> Configuration:
    """Read the executive's parameters from a folder of parameter files.

    :returns: a configuration with the tree ``/clips-executive``.
    :raises ConfigError: if the file is unreadable or has no parameters of the executive.
    """
    file = folder / EXECUTIVE_FILE
    ros_parameters = Configuration.load(file)
    parameter_path = f"/{EXECUTIVE_NODE}/ros__parameters"
    if not ros_parameters.keys(parameter_path):
        raise ConfigError(
            f"there are no parameters of the node {EXECUTIVE_NODE}",
            file=file,
            hint=f"they belong below {EXECUTIVE_NODE}: ros__parameters:",
        )
    config = Configuration()
    config.overlay(ros_parameters.below(parameter_path).copy_below(EXECUTIVE_TREE))
    config.files = ros_parameters.files
    config.warnings = ros_parameters.warnings
    return config


def load_feature_entries(folder: Path) -> tuple[FeatureEntry, ...]:
    """Read the features from the parameter files.

    :raises ConfigError: if the file is unreadable, the list or a plugin is missing or has a wrong type, or a
        feature is listed twice.
    """
    file = folder / FEATURES_FILE
    config = Configuration.load(file)
    parameter_path = f"/{FEATURES_NODE}/ros__parameters"
    if not config.exists(f"{parameter_path}/clips_features"):
        raise ConfigError(
            f"there are no clips_features of the node {FEATURES_NODE}",
            file=file,
            hint=f"write clips_features: [NAME] or [] below {FEATURES_NODE}: ros__parameters:",
        )
    entries: list[FeatureEntry] = []
    list_path = f"{parameter_path}/clips_features"
    for name in config.get_strings(list_path):
        if any(entry.name == name for entry in entries):
            raise config.error(list_path, f"the feature '{name}' is listed twice", "list each feature once")
        path = f"{parameter_path}/{name}/plugin"
        if not config.exists(path):
            raise config.error(
                list_path,
                f"the feature '{name}' has no plugin",
                f'write below ros__parameters: {name}: {{plugin: "cx::..."}}',
            )
        plugin = config.get(path)
        entries.append(
            FeatureEntry(name, config.get_str(path), plugin.file or str(file), plugin.line or None)
        )
    return tuple(entries)


def read_refresh_period_us(config: Configuration) -> int:
    """Return the time between two runs of the rules, by the rate ``refresh-rate``.

    :raises ConfigError: if the rate is not a number, is not positive, or is above 10000 Hz.
    """
    rate_hz = config.get_float(REFRESH_RATE_PATH, default=float(_DEFAULT_REFRESH_HZ))
    if 0 < rate_hz <= _MAX_REFRESH_HZ:
        return round(MICROSECONDS / rate_hz)
    raise config.error(
        REFRESH_RATE_PATH,
        f"refresh-rate cannot be {rate_hz:g}",
        f"the rate is in Hz, above 0 and at most {_MAX_REFRESH_HZ}",
    )
