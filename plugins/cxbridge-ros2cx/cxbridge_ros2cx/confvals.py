"""The feature ``config_feature`` of the thesis' executive: parameters as facts ``confval``.

The feature of ros2-clips-executive (2021) differs from Fawkes' feature ``config``: the facts have the file's
order, the type is never UINT, and list elements and all values within a list of maps are strings. In the
thesis' executive that includes TRUE and FALSE, so with ``feature-request: false`` its init.clp waits forever.
Source: ConfigFeature.cpp.
"""

from __future__ import annotations

import re
from pathlib import Path

from cxbridge.config import Configuration, ConfigValue
from cxbridge.errors import CxbridgeError
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from cxbridge_ros2cx.parameters import EXECUTIVE_NODE, EXECUTIVE_TREE, YAML_FALSE, YAML_INTEGER, YAML_TRUE

CONFIG_FEATURE = "config_feature"
_SECTION = "ros__parameters"
_FLOAT = re.compile(r"[+-]?(\d+\.\d*|\.\d+|\d+)([eE][+-]?\d+)?\Z")
# the index of a map within a list, in the path of a value: /stages/0/name
_INDEX = re.compile(r"/\d+/")


class ParametersFeature(Feature):
    """Defines ``config-load`` and the template ``confval``.

    :param config: the configuration of the run, with the parameters of the executive's node.
    :param folder: the folder of parameter files, for the prefixes of other nodes.
    :param repeats_defects: whether TRUE and FALSE in lists of maps become strings, as in the thesis'
        executive.
    """

    name = CONFIG_FEATURE

    def __init__(self, config: Configuration, folder: Path, *, repeats_defects: bool = False) -> None:
        self._config = config
        self._folder = folder
        self._repeats_defects = repeats_defects

    def init_context(self, env: ClipsEnvironment) -> None:
        env.call("path-load", "ff-config.clp")
        env.define("config-load", lambda prefix: self._load(env, prefix), 1, types="*;sy")

    def _load(self, env: ClipsEnvironment, prefix: str) -> None:
        """Assert a ``confval`` for each parameter of a node, e.g. ``/clips_executive``."""
        log = env.bus.logger(f"ClipsConfig|{env.name}")
        node = str(prefix).strip("/")
        if node == EXECUTIVE_NODE:
            tree, config = EXECUTIVE_TREE, self._config
        else:
            tree = f"/{node}"
            try:
                config = Configuration.load(self._folder / f"{node}.yaml")
            except CxbridgeError as error:
                log.error(f"Cannot load the parameters of {prefix}: {error}")
                return
        for parameter in config.walk(tree):
            # the rules expect the paths of the ROS node, without ros__parameters
            path = f"/{node}{parameter.path[len(tree) :]}".replace(f"/{_SECTION}", "", 1)
            slots = _make_confval_slots(parameter, repeats_defects=self._repeats_defects)
            if slots is not None:
                env.assert_fact("confval", {"path": path, **slots})


def _make_confval_slots(parameter: ConfigValue, *, repeats_defects: bool) -> dict[str, Value] | None:
    """Return the slots of a parameter except its path; None for an empty list, which gets no fact."""
    if parameter.is_list:
        if not parameter.items:
            return None
        return {"type": Symbol("STRING"), "is-list": TRUE, "list-value": tuple(parameter.items)}
    type_name = find_scalar_type(parameter.text)
    # within a list of maps each value is a string, in the mode `original` even TRUE and FALSE
    if type_name == "STRING" or (_INDEX.search(parameter.path) and (repeats_defects or type_name != "BOOL")):
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
