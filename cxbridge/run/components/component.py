"""The base class of components. How to write a component: docs/daemon.md."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.manager import EnvironmentManager
    from cxbridge.mainloop import Hook


class Component:
    """A part of a run or a daemon. A subclass overrides the methods that it needs.

    The constructor acquires the resources, and leaves nothing behind when it raises.

    :param run: the run or daemon, a :class:`cxbridge.run.agent.Run`: what all components share.
    """

    hooks: ClassVar[Sequence[Hook]] = ()
    """Where the main loop calls :meth:`loop`."""

    steady: ClassVar[bool] = False
    """Whether the component works while a daemon is paused or reset."""

    description: ClassVar[str] = ""
    """A line about it, for ``ffplugin``."""

    def __init__(self, run: Any) -> None:
        """Acquire the resources."""

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
        """Whether the component changes nothing until rules ask it to: a run that waits for it may end."""
        return False

    @property
    def loss(self) -> str:
        """Why a run cannot come to its end: the part that is gone; empty while none is gone."""
        return ""


class ThinkingComponent(Component):
    """The executive of a run.

    :ivar manager: makes its environments.
    :ivar firings: how many rules have fired.
    """

    manager: EnvironmentManager
    executive: Executive
    firings: int

    @abstractmethod
    def watch(self) -> None:
        """Watch facts and rules for history and recording, from before the first file is loaded."""

    @property
    @abstractmethod
    def is_stuck(self) -> bool:
        """Whether nothing can happen to the agent any more."""

    @abstractmethod
    def waits_for(self, failed_rules: Iterable[str]) -> str:
        """Return the events that the agent waits for and that cannot come.

        :param failed_rules: the rules whose actions an error has ended.
        """

    @abstractmethod
    def finalize(self) -> None:
        """Let the rules run their finalization; a second call does nothing."""

    @abstractmethod
    def forgo_finalization(self) -> None:
        """Let :meth:`finalize` do nothing."""


def is_component(loaded: object) -> bool:
    """Return whether an object is a subclass of :class:`Component`."""
    return isinstance(loaded, type) and issubclass(loaded, Component)
