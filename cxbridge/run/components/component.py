"""Base classes of components. docs/daemon.md shows how to write a component."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.manager import EnvironmentManager
    from cxbridge.mainloop import Hook


class Component:
    """A part of a run or a daemon. Subclasses override the methods they need.

    The constructor acquires resources; it must release them before it raises.

    :param run: a :class:`cxbridge.run.agent.Run`, or a daemon.
    """

    hooks: ClassVar[Sequence[Hook]] = ()
    """The hooks of the main loop that call :meth:`loop`."""

    steady: ClassVar[bool] = False
    """Whether the component works while a daemon is paused or reset."""

    description: ClassVar[str] = ""
    """One line about the component, for lists."""

    def __init__(self, run: Any) -> None: ...

    def configure(self) -> None:
        """Prepare for work. Other components may call this component afterwards."""

    def abort(self) -> None:
        """Release all resources after :meth:`configure` failed."""
        self.close()

    def activate(self) -> None:
        """Start working."""

    def deactivate(self) -> None:
        """Stop working and keep all resources."""

    def loop(self) -> None:
        """Do one step of the main loop."""

    def check(self) -> None:
        """Raise an error if the component is broken. A daemon calls this method about once a second."""

    def close(self) -> None:
        """Release all resources."""

    @property
    def running(self) -> bool:
        """Whether the component has work that a run must wait for."""
        return False

    @property
    def is_quiet(self) -> bool:
        """Whether only a request of a rule changes the component. A run is stuck only if all are quiet."""
        return False

    @property
    def loss_reason(self) -> str:
        """The lost connection or object that the run needs, with the reason; empty if none is lost."""
        return ""


class BaseExecutiveComponent(Component):
    """The executive of a run.

    :ivar firings: the number of rule firings.
    """

    manager: EnvironmentManager
    executive: Executive
    firings: int

    @abstractmethod
    def watch(self) -> None:
        """Watch facts and rules for history and recordings. To be called before the first file is loaded."""

    @abstractmethod
    def finalize(self) -> None:
        """Run the finalization rules once."""

    @abstractmethod
    def skip_finalization(self) -> None:
        """Make :meth:`finalize` do nothing, because a killed process fires no finalization rule."""


def is_component(loaded: object) -> bool:
    """Return whether a loaded object is a class of components."""
    return isinstance(loaded, type) and issubclass(loaded, Component)
