"""DDS security, which the transport dds lacks."""

from __future__ import annotations

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.transports.dds import DdsNode


def test_dds_refuses_to_start_with_enforced_security(monkeypatch: pytest.MonkeyPatch, domain: int):
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    with pytest.raises(Ros2Error, match="built without DDS security") as raised:
        DdsNode("one", Definitions(environment={}), domain + 17)
    assert raised.value.hint == "use the transport rclpy in a sourced ROS 2"


def test_dds_without_enforced_security_reports_missing_encryption(
    monkeypatch: pytest.MonkeyPatch, domain: int
):
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    reports: list[str] = []
    with DdsNode("one", Definitions(environment={}), domain + 17, report=reports.append):
        assert [each.rpartition(", so no data is encrypted")[1] for each in reports] == [
            ", so no data is encrypted"
        ]
