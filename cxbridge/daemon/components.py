"""The components of a daemon, one by one: how each stands, and the steps of its life."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cxbridge.run.components.manager import ComponentManager, ComponentStatus


def component_row(status: ComponentStatus) -> dict[str, Any]:
    """Return a description of a component, as JSON can have it."""
    return {
        "name": status.name,
        "state": status.state.name,
        "since_us": status.since_us,
        "reason": status.reason,
    }


class DaemonComponents:
    """Lets clients look at single components and change their states, in the thread of the main loop.

    :param manager: has the components.
    :param status: returns how they stand.
    :param settle: called after each change.
    """

    def __init__(
        self,
        manager: ComponentManager,
        status: Callable[[], list[ComponentStatus]],
        settle: Callable[[], None],
    ) -> None:
        self._manager = manager
        self._status = status
        self._settle = settle

    def status(self) -> list[ComponentStatus]:
        """Return a description of each, in the order of their start."""
        return self._status()

    def change_one(self, name: str, transition: str) -> None:
        """Let one component take one step of its life; see :meth:`ComponentManager.change_one`.

        :raises LifecycleError: when it cannot.
        """
        try:
            self._manager.change_one(name, transition)
        finally:
            self._settle()
