"""The plug-in ``cx::ExamplePlugin``, a template for authors of plug-ins.

Copy the class under another name, define functions and templates in ``init_context``, and declare the class
as an entry point; see :mod:`cxbridge_ros2cx.cx.plugin`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


class ExamplePlugin(CxPlugin):
    """Logs when an environment loads or unloads the plug-in."""

    def init_context(self, env: ClipsEnvironment) -> None:
        self.log.info(f"Initializing plugin for environment {env.name}")

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        self.log.info(f"Destroying plugin for environment {env.name}")
