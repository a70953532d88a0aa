"""The feature ``redefine-warning``: logs an error if a file redefines a construct."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import ClipsEnvironment


class RedefineWarningFeature(Feature):
    """Makes the loader report redefinitions. As in Fawkes, the redefinition still happens."""

    name = "redefine-warning"

    def init_context(self, env: ClipsEnvironment) -> None:
        env.loader.warn_redefinitions = True

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        env.loader.warn_redefinitions = False
