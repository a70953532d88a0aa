"""The check of agents of the ROS 2 CX."""

from __future__ import annotations

import pytest

pytest.importorskip("cxbridge_studio", reason="needs cxbridge-studio")

from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge_studio.check.run import check
from ros2cx_tests.cx.test_examples import PDDL, PLUGINS, TUTORIALS
from tests.support import CX_DIR, needs_cx

pytestmark = needs_cx

VALID_FILES = (
    *(f"{PLUGINS}/{name}.yaml" for name in ("config", "executive", "file_load", "protobuf", "ros_msgs")),
    *(f"{PLUGINS}/{name}.yaml" for name in ("ros_msgs_client", "ros_msgs_service", "ros_param")),
    *(f"{PLUGINS}/{name}.yaml" for name in ("ros_msgs_action_client", "set_bool_srv", "string_msg")),
    f"{TUTORIALS}/turtlesim.yaml",
    f"{PDDL}/raw_agent.yaml",
)


def check_file(file):
    return [str(each) for each in check(options_from_keywords(file, ros2cx=CX_DIR))]


@pytest.mark.parametrize("name", VALID_FILES)
def test_example_has_no_findings(name):
    assert check_file(CX_DIR / name) == []
