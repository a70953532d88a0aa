"""The base class of components. How to write a component: docs/daemon.md."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from cxbridge.mainloop import Hook
    from cxbridge.run.context import RunContext


class Component:
    """A part of a run or a daemon. Override what it needs; nothing has to be.

    Making it acquires what it works with, and leaves nothing behind when it raises.

    :param context: what all components share.
    """

    hooks: ClassVar[Sequence[Hook]] = ()
    """Where the main loop calls :meth:`loop`."""

    steady: ClassVar[bool] = False
    """Whether it goes on while a daemon is paused or reset."""

    description: ClassVar[str] = ""
    """A line about it, for ``ffplugin``."""

    def __init__(self, context: RunContext) -> None:
        """Acquire what it works with."""

    def configure(self) -> None:
        """Get ready to work; other components may call it from now on."""

    def abort(self) -> None:
        """Release everything after :meth:`configure` has failed."""
        self.close()

    def activate(self) -> None:
        """Begin to work."""

    def deactivate(self) -> None:
        """Stop working; everything that was acquired stays."""

    def loop(self) -> None:
        """Do the work of a loop, at each of the hooks."""

    def check(self) -> None:
        """Raise when it does not work any more; a daemon asks about once a second."""

    def close(self) -> None:
        """Release everything."""

    @property
    def running(self) -> bool:
        """Whether it has begun something that a run has to wait for."""
        return False

    @property
    def is_quiet(self) -> bool:
        """Whether it changes nothing until rules ask it to: a run may end that waits for it in vain."""
        return False

    @property
    def loss(self) -> str:
        """Why a run cannot come to its end without what is gone; empty while all is there."""
        return ""


def is_component(loaded: object) -> bool:
    """Return whether an object is a subclass of :class:`Component`."""
    return isinstance(loaded, type) and issubclass(loaded, Component)
