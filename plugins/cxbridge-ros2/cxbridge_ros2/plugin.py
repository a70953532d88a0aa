"""The extensions of this plug-in; see docs/plugins.md.

Each :class:`~cxbridge.plugins.Row` names an extension, the ``module:object`` that cxbridge imports when the
extension is used, and for some kinds a predicate that says whether a configuration uses it.
"""

from __future__ import annotations

from typing import Any

from cxbridge.plugins import Row, always, configured
from cxbridge_ros2.fawkes_keys import has_cxbridge_keys

API = 1  # version of the plug-in interface


def _has_daemon_node(context: Any) -> bool:
    return context.section("ros2") is not None and bool(context.config.keys("/ros2/node"))


def _has_transforms(context: Any) -> bool:
    return has_cxbridge_keys(context.config, "/ros2/tf")


def _has_nodes(config: Any) -> bool:
    return bool(config.keys("/ros2"))


_COMPONENTS = "cxbridge_ros2.components"

CLOCKS = (Row("ros2", "cxbridge_ros2.sim_time:make_clock"),)
COMMANDS = (Row("ros2", "cxbridge_ros2.cli.ros2", section="Blackboard"),)
COMPONENTS = (
    # early, so that /rosout has the log lines of the starts of the other components
    Row("ros2-node", f"{_COMPONENTS}.node:Ros2NodeComponent", _has_daemon_node, early=always),
    Row("ros2-performers", f"{_COMPONENTS}.performers:Ros2Performers", configured("/ros2/performers")),
    Row("ros2-experts", f"{_COMPONENTS}.experts:Ros2Experts", configured("/ros2/experts")),
    Row("ros2-interfaces", f"{_COMPONENTS}.interfaces:Ros2Interfaces", configured("/ros2/interfaces")),
    Row("ros2-skiller", f"{_COMPONENTS}.skiller:Ros2Skiller", configured("/ros2/skiller")),
    Row("ros2-tf", f"{_COMPONENTS}.transforms:Ros2Transforms", _has_transforms),
)
FEATURES = (
    Row(
        "problem-expert",
        "cxbridge_ros2.problem_expert:shared_problem_expert_feature",
        requested=configured("/ros2/experts"),
    ),
)
FORMATS = (Row("rosbag", "cxbridge_ros2.bags.formats"),)
SETTINGS = (Row("ros2", "cxbridge_ros2.settings:Ros2Reach", _has_nodes),)
