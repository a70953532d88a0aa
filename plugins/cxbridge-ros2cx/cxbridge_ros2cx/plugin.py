"""The plug-in's tables, described in docs/plugins.md."""

from __future__ import annotations

from cxbridge.plugins import Row
from cxbridge_ros2cx.options import is_clips_manager_agent

API = 1  # version of the plug-in interface

OPTIONS = (Row("ros2cx", "cxbridge_ros2cx.options:Ros2CxOptions"),)
SOURCES = (
    Row("clips-manager", "cxbridge_ros2cx.cx.source:CxSource", is_clips_manager_agent),
    Row("ros2cx", "cxbridge_ros2cx.source:Ros2CxSource", lambda options: bool(options.option("ros2cx"))),
)
TEMPLATES = (Row("ros2cx", "cxbridge_ros2cx.projects:Ros2CxTemplate"),)
