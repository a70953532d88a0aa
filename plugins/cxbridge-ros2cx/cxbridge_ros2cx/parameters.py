"""The parameter files of ros2-clips-executive (2021), the original, as the configuration of a run.

A ROS parameter file has ``NODE: ros__parameters: ...``. The parameters of the node ``clips_executive`` become
the tree ``/clips-executive``; those of ``clips_features_manager`` list the features.
"""

from __future__ import annotations

import re
from pathlib import Path

from msgspec import Struct

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError

EXECUTIVE_NODE = "clips_executive"
FEATURES_NODE = "clips_features_manager"
EXECUTIVE_FILE = "clips_executive.yaml"
FEATURES_FILE = "cx_params.yaml"

EXECUTIVE_TREE = "/clips-executive"  # tree of the executive's parameters in a run, as in Fawkes

REFRESH_RATE = f"{EXECUTIVE_TREE}/refresh-rate"  # rate of the executive's rules in Hz

_DEFAULT_REFRESH_RATE = 10  # the original's default, in Hz
_MAX_HZ = 10_000

# scalars of YAML 1.1, which the parsers of ROS 2 and of the original read
YAML_TRUE = frozenset({"y", "yes", "true", "on"})
YAML_FALSE = frozenset({"n", "no", "false", "off"})
YAML_INTEGER = re.compile(r"[+-]?(0[xX][0-9a-fA-F]+|\d+)\Z")


class FeatureEntry(Struct, frozen=True):
    """A feature of the file ``cx_params.yaml``.

    :param name: the name in ``(ff-feature-request ...)``.
    :param plugin: the class of the original, e.g. ``cx::Plansys2Feature``.
    """

    name: str
    plugin: str
    file: str | None = None
    line: int | None = None


def load_parameters(folder: Path) -> Configuration:
    """Read the executive's parameters from a folder of parameter files.

    :returns: a configuration with the tree ``/clips-executive``.
    :raises ConfigError: if the file is missing or has no parameters of the executive.
    """
    file = folder / EXECUTIVE_FILE
    raw = Configuration.load(file)
    below = f"/{EXECUTIVE_NODE}/ros__parameters"
    if not raw.keys(below):
        raise ConfigError(
            f"there are no parameters of the node {EXECUTIVE_NODE}",
            file=file,
            hint=f"they belong below {EXECUTIVE_NODE}: ros__parameters:; {_section_names(raw)}",
        )
    config = Configuration()
    config.overlay(raw.below(below).moved(EXECUTIVE_TREE))
    config.files = raw.files
    config.warnings = raw.warnings
    return config


def load_features(folder: Path) -> tuple[FeatureEntry, ...]:
    """Read the features from the parameter files.

    :raises ConfigError: if the file or a plugin is missing, or a feature is listed twice.
    """
    file = folder / FEATURES_FILE
    config = Configuration.load(file)
    tree = f"/{FEATURES_NODE}/ros__parameters"
    if not config.exists(f"{tree}/clips_features"):
        raise ConfigError(
            f"there are no clips_features of the node {FEATURES_NODE}",
            file=file,
            hint=f"below {FEATURES_NODE}: ros__parameters:, [] for none; {_section_names(config)}",
        )
    entries: list[FeatureEntry] = []
    for name in config.get_strings(f"{tree}/clips_features"):
        if any(entry.name == name for entry in entries):
            raise _list_error(config, tree, f"the feature '{name}' is listed twice", "name each once")
        path = f"{tree}/{name}/plugin"
        if not config.exists(path):
            hint = f'write below ros__parameters: {name}: {{plugin: "cx::..."}}'
            raise _list_error(config, tree, f"the feature '{name}' has no plugin", hint)
        plugin, value = config.get_str(path), config.get(path)
        entries.append(FeatureEntry(name, plugin, value.file or str(file), value.line or None))
    return tuple(entries)


def _section_names(config: Configuration) -> str:
    return f"the file has {', '.join(config.keys()) or 'nothing'}"


def _list_error(config: Configuration, tree: str, message: str, hint: str) -> ConfigError:
    return config.error(f"{tree}/clips_features", message, hint)


def refresh_period_us(config: Configuration) -> int:
    """Return the time between two runs of the rules.

    :raises ConfigError: if the rate is not positive, or is above 10000 Hz.
    """
    rate = config.get_float(REFRESH_RATE, default=float(_DEFAULT_REFRESH_RATE))
    if 0 < rate <= _MAX_HZ:
        return round(1_000_000 / rate)
    raise config.error(REFRESH_RATE, f"refresh-rate cannot be {rate:g}", f"Hz, more than 0, up to {_MAX_HZ}")
