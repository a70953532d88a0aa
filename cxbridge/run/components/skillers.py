"""The Skillers of this process as a component."""

from __future__ import annotations

from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge.run.components.table import local_skillers
from cxbridge.run.context import RunContext
from cxbridge.run.skillers import SkillerGroup, make_skillers


class Skillers(Component):
    """Execute skill strings.

    :param skillers: those of a recording; None: those of the configuration.
    :raises CxbridgeError: when skills cannot be loaded, or somebody else writes an interface.
    """

    hooks = (Hook.SKILL,)
    description = "Executes skills, or mirrors the Skiller that does"

    def __init__(self, context: RunContext, skillers: SkillerGroup | None = None) -> None:
        self._skillers = skillers or make_skillers(context, local_skillers(context))
        context.known_skills.update(self._skillers.known_by_name)

    def loop(self) -> None:
        """Let each take its step."""
        self._skillers.loop()

    @property
    def running(self) -> bool:
        """Whether any of them executes a skill string."""
        return self._skillers.running

    @property
    def is_quiet(self) -> bool:
        """Whether all wait for a skill string."""
        return self._skillers.is_quiet

    def close(self) -> None:
        """Close them."""
        self._skillers.close()
