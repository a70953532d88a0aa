"""DDS security: the transport dds refuses to do without the security that the environment enforces."""

from __future__ import annotations

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.transports.dds import DdsNode


def test_dds_by_the_wheel_does_not_go_without(monkeypatch: pytest.MonkeyPatch, domain: int):
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    with pytest.raises(Ros2Error, match="built without DDS security") as raised:
        DdsNode("one", Definitions(environment={}), domain + 17)
    assert raised.value.hint == "use the transport rclpy in a sourced ROS 2"


def test_where_it_may_go_without_it_says_so(monkeypatch: pytest.MonkeyPatch, domain: int):
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    said: list[str] = []
    with DdsNode("one", Definitions(environment={}), domain + 17, report=said.append):
        assert [each.rpartition(", so no data is encrypted")[1] for each in said] == [
            ", so no data is encrypted"
        ]
