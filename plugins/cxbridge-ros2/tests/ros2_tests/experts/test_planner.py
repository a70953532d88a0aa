"""The planner of the experts without the package of planners."""

from __future__ import annotations

from typing import Any

from cxbridge import plugins
from cxbridge.run.features import FEATURES
from cxbridge_ros2.experts.plan_server import PlanServer
from ros2_tests.experts.test_services import MEETING_DOMAIN, MEETING_PROBLEM


def test_response_names_package_of_planners(monkeypatch):
    monkeypatch.setattr(plugins, "installed_plugins", tuple)
    responses: list[Any] = []
    with PlanServer(lambda: FEATURES.find("planner")) as server:
        server.start_planning({"domain": MEETING_DOMAIN, "problem": MEETING_PROBLEM}, responses.append)
    assert not responses[0]["success"]
    assert "planner belongs to the plug-in cxbridge-planning: " in responses[0]["error_info"]
