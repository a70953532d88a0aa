"""The feature ``config_feature`` of the thesis' executive: parameters as facts ``confval``.

The feature of ros2-clips-executive (2021) differs from Fawkes' feature ``config``: the facts have the file's
order, the type is never UINT, and list elements and all values within a list of maps are strings. Here a
boolean within a list of maps is TRUE or FALSE, since with the string "false" as ``feature-request`` the
init.clp of the executive would wait forever for a feature.
Source: ConfigFeature.cpp.
"""

from __future__ import annotations

import re

from cxbridge.config import Configuration, ConfigValue
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from cxbridge_ros2cx.parameters import EXECUTIVE_NODE, EXECUTIVE_TREE, YAML_FALSE, YAML_INTEGER, YAML_TRUE

CONFIG_FEATURE = "config_feature"
# a number with or without a point and an exponent, as yaml-cpp accepts for a double
_FLOAT = re.compile(r"[+-]?(\d+\.\d*|\.\d+|\d+)([eE][+-]?\d+)?\Z")
# the index of a map within a list, in the path of a value: /stages/0/name
_INDEX = re.compile(r"/\d+/")


class ConfvalFeature(Feature):
    """Defines ``config-load`` and the template ``confval``.

    :param config: the configuration of the run, with the parameters of the executive's node.
    """

    name = CONFIG_FEATURE

    def __init__(self, config: Configuration) -> None:
        self._config = config

    def init_context(self, env: ClipsEnvironment) -> None:
        env.call("path-load", "ff-config.clp")
        # types are the codes of CLIPS' AddUDF: any result (*), a SYMBOL or STRING as argument (sy)
        env.define("config-load", lambda prefix: self._load(env, prefix), 1, types="*;sy")

    def _load(self, env: ClipsEnvironment, prefix: str) -> None:
        """Assert a ``confval`` for each parameter of the executive's node, except for empty lists.

        :param prefix: the name of the executive's node; the parameters of other nodes are unknown.
        """
        log = env.bus.logger(f"ClipsConfig|{env.name}")
        if str(prefix).strip("/") != EXECUTIVE_NODE:
            log.error(f"Cannot load the parameters of {prefix}: only those of {EXECUTIVE_NODE} are known")
            return
        for parameter in self._config.walk(EXECUTIVE_TREE):
            path = f"/{EXECUTIVE_NODE}{parameter.path.removeprefix(EXECUTIVE_TREE)}"
            if not parameter.is_list or parameter.items:  # an empty list gets no fact
                env.assert_fact("confval", {"path": path, **_make_confval_slots(parameter)})


def _make_confval_slots(parameter: ConfigValue) -> dict[str, Value]:
    """Return the slots of a parameter except its path."""
    if parameter.is_list:
        return {"type": Symbol("STRING"), "is-list": TRUE, "list-value": tuple(parameter.items)}
    type_name = find_scalar_type(parameter.text)
    # within a list of maps each value except TRUE and FALSE is a string
    if type_name == "STRING" or (_INDEX.search(parameter.path) and type_name != "BOOL"):
        return {"type": Symbol(type_name), "value": parameter.text}
    if type_name == "BOOL":
        return {"type": Symbol(type_name), "value": TRUE if parameter.text.lower() in YAML_TRUE else FALSE}
    return {"type": Symbol(type_name), "value": clips_scalar(parameter.text)}


def find_scalar_type(text: str) -> str:
    """Return the type of a scalar for the rules: BOOL, INT, FLOAT or STRING.

    Quotes make no difference: the executives try yaml-cpp's conversions on the text, one after another.
    """
    if text.lower() in YAML_TRUE | YAML_FALSE:
        return "BOOL"
    if YAML_INTEGER.match(text):
        return "INT"
    return "FLOAT" if _FLOAT.match(text) else "STRING"
