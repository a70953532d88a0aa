"""The features ``config``, which asserts the configuration as facts, and ``redefine-warning``.

The executive itself requests them before it loads the core: ``config`` always, ``redefine-warning`` unless
the configuration forbids it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from cxbridge.config import ConfigType, Configuration, ConfigValue
from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value

_INTEGER = re.compile(r"[+-]?\d+\Z")
_FLOAT = re.compile(r"[+-]?(\d+\.\d*|\.\d+|\d+)([eE][+-]?\d+)?\Z")


def clips_scalar(text: str) -> Value:
    """Return the INTEGER or FLOAT of a number's text, or a SYMBOL of another text, e.g. ``0x10``."""
    if _INTEGER.match(text):
        return int(text)
    if _FLOAT.match(text):
        return float(text)
    return Symbol(text)


class ConfigFeature(Feature):
    """Provides ``config-load`` and the template ``confval``."""

    name = "config"

    def __init__(self, config: Configuration) -> None:
        self._config = config

    def init_context(self, env: ClipsEnvironment) -> None:
        def load(prefix: str) -> None:
            for slots in confvals(self._config, prefix):
                env.assert_fact("confval", slots)

        env.call("path-load", "ff-config.clp")
        env.define("config-load", load, 1, types="*;sy")


def confvals(config: Configuration, prefix: str) -> Iterator[dict[str, Value]]:
    """Yield the slots of a fact ``confval`` for each value below ``prefix``, sorted by path."""
    for item in config.search(prefix):
        slots: dict[str, Value] = {"path": item.path, "type": Symbol(item.type.name)}
        if item.is_list:
            slots["is-list"] = TRUE
            slots["list-value"] = tuple(_clips_value(item, text) for text in item.items)
        else:
            slots["value"] = _clips_value(item, item.text)
        yield slots


def _clips_value(item: ConfigValue, text: str) -> Value:
    """Return the CLIPS value of a scalar, as Fawkes converts it.

    :param text: the text of the value, or of an element of its list.
    """
    if item.type is ConfigType.STRING:
        return text
    if item.type is ConfigType.BOOL:
        return TRUE if text.lower() in ("y", "yes", "true", "on") else FALSE
    return clips_scalar(text)


class RedefineWarningFeature(Feature):
    """Lets the loader log each redefinition of a construct. As in Fawkes, the redefinition still happens."""

    name = "redefine-warning"

    def init_context(self, env: ClipsEnvironment) -> None:
        env.loader.warn_redefinitions = True
