"""The plug-in ``cx::ExamplePlugin``, a template for authors of plug-ins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


class ExamplePlugin(CxPlugin):
    """Logs the creation and the end of each environment."""

    def init_context(self, env: ClipsEnvironment) -> None:
        self.log.info(f"Initializing plugin for environment {env.name}")

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        self.log.info(f"Destroying plugin for environment {env.name}")
