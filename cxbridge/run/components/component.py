"""The base class of components, and the entries of their tables. How to write one: docs/daemon.md."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, Final

from msgspec import Struct

from cxbridge.errors import CxbridgeError
from cxbridge.executive.plugins import installed_entry_points
from cxbridge.extras import missing_package

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from cxbridge.mainloop import Hook
    from cxbridge.run.context import RunContext

GROUP: Final = "cxbridge.components"
"""The group of entry points. Each names a component and a subclass of :class:`Component`."""


class ComponentError(CxbridgeError):
    """A component of an installed package that cannot be used."""


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

    @classmethod
    def is_needed(cls, context: RunContext) -> bool:  # noqa: ARG003 - most look at the configuration
        """Return whether a run or daemon shall have it; for components of installed packages."""
        return True

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


class ComponentEntry(Struct, frozen=True):
    """A row of a table of components.

    :param target: ``module:Class``; imported when the component is needed.
    :param is_needed: whether a run or daemon has it.
    """

    name: str
    target: str
    is_needed: Callable[[Any], bool] = lambda _context: True

    def load(self) -> type[Any]:
        """Import the class, a subclass of :class:`Component`."""
        module, _, name = self.target.partition(":")
        try:
            loaded: type[Any] = getattr(import_module(module), name)
        except ModuleNotFoundError as error:
            raise missing_package(error) or error from None
        return loaded


class InstalledComponent(Struct, frozen=True):
    """A component that an installed package brings along."""

    entry: EntryPoint

    @property
    def name(self) -> str:
        """Its name in lists and logs."""
        return self.entry.name

    def is_needed(self, context: RunContext) -> bool:
        """Whether the run or daemon has it."""
        return self.load().is_needed(context)

    def load(self) -> type[Component]:
        """Import the class.

        :raises ComponentError: when it cannot be imported, or is none.
        """
        try:
            loaded = self.entry.load()
        except Exception as error:
            raise self._refused(f"{type(error).__name__}: {error}") from error
        if not (isinstance(loaded, type) and issubclass(loaded, Component)):
            raise self._refused(f"{loaded!r} is not a subclass of {Component.__module__}.Component")
        return loaded

    def _refused(self, reason: str) -> ComponentError:
        package = self.entry.dist.name if self.entry.dist is not None else "?"
        return ComponentError(
            f"the component '{self.name}' ({self.entry.value} of {package}) cannot be loaded: {reason}",
            hint="see docs/daemon.md, or remove that package",
        )


def installed_components() -> Iterator[InstalledComponent]:
    """Yield the components of installed packages, sorted by name."""
    for entry in sorted(installed_entry_points(GROUP), key=lambda entry: entry.name):
        yield InstalledComponent(entry)
