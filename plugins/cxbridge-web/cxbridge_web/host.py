"""The interface of the process around a web server."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.config import Configuration
    from cxbridge.events import EventBus
    from cxbridge.executive.debugger import Debugger
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.operations.operation import OperationContext
    from cxbridge.rights import Rights


class WebHost(Protocol):
    """The process around a web server. What says nothing else is called by the main loop's thread."""

    @property
    def board(self) -> BlackBoard:
        """The blackboard."""

    @property
    def bus(self) -> EventBus:
        """What happens."""

    @property
    def config(self) -> Configuration:
        """The configuration."""

    @property
    def rights(self) -> Rights:
        """What clients may do."""

    @property
    def debugger(self) -> Debugger | None:
        """The executive's debugger; None while the executive does not run."""

    @property
    def operations(self) -> OperationContext:
        """What operations work on."""

    def environments(self) -> Mapping[str, ClipsEnvironment]:
        """Return the CLIPS environments by name; empty while the executive does not run."""

    def status(self) -> dict[str, Any]:
        """Return how the process and its components stand; docs/rest.md has the fields."""

    def command(self, what: str) -> None:
        """Carry out ``pause``, ``resume`` or ``reset``."""

    @property
    def stall(self) -> str:
        """Why the main loop does not come to its end; empty when it does. In any thread."""

    def interrupt(self) -> None:
        """End what rules do in this loop; in any thread."""

    def plugins(self) -> Sequence[tuple[str, str, bool]]:
        """Return name, description and whether it is loaded, of all plugins."""

    def load_plugin(self, name: str, *, load: bool) -> None:
        """Load or unload a plugin; no error when it is already.

        :raises CxbridgeError: when that is not possible.
        """

    def frames(self) -> Mapping[str, str | None]:
        """Return the parent of each coordinate frame, None for roots; by name."""

    def why(self, name: str, kind: str, timeout_s: float) -> dict[str, Any] | None:
        """Explain why a rule has not fired, or how a goal came about; in any thread but the main loop's.

        :param kind: ``rule``, ``goal`` or empty.
        :returns: ``lines`` and ``data``; None when there is no answer in time.
        :raises CxbridgeError: when there is nothing to explain.
        """
