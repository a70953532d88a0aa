"""The feature `redefine-warning`: an error in the log when a file defines a construct that exists."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import ClipsEnvironment


class RedefineWarningFeature(Feature):
    """Makes the loader report redefinitions. Nothing is prevented, as in Fawkes."""

    name = "redefine-warning"

    def init_context(self, env: ClipsEnvironment) -> None:
        """Switch it on."""
        env.loader.warn_redefinitions = True

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Switch it off."""
        env.loader.warn_redefinitions = False
