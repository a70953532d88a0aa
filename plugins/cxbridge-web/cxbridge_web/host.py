"""The interface of the process that hosts a web server: a daemon or a run."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from cxbridge import __version__
from cxbridge.daemon.client import ask_why

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.daemon.operations.operation import OperationContext
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.rights import Rights
    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team
    from cxbridge.space.tf.listener import TransformListener

_OWNER: Final = "TransformsRestApi"  # the reader of the transforms, named as in Fawkes
_MAX_RULES: Final = 1  # the number of fired rules that an explanation lists before each step of a goal


class WebHost(ABC):
    """The process that hosts a web server. Methods run in the main loop's thread unless documented otherwise.

    :param run: the run whose data the server shows; a daemon is a run, too.
    """

    operations: OperationContext  # context in which operations are carried out

    def __init__(self, run: Run | Team) -> None:
        self.bus: Final = run.bus
        self.config: Final = run.config
        self._run = run
        self._start_us: Final = run.clock.start_us  # the first access sets the start
        self._transform_listener: TransformListener | None = None

    @property
    @abstractmethod
    def board(self) -> BlackBoard:
        """The blackboard of the process."""

    @property
    @abstractmethod
    def rights(self) -> Rights:
        """The rights of clients."""

    @property
    @abstractmethod
    def executive(self) -> Executive | None:
        """The executive; None while the executive does not run."""

    @abstractmethod
    def environments(self) -> Mapping[str, ClipsEnvironment]:
        """Return the CLIPS environments by name; empty while the executive does not run."""

    @abstractmethod
    def status(self) -> dict[str, Any]:
        """Return the status of the process and its components; docs/rest.md has the fields."""

    @abstractmethod
    def run_command(self, verb: str) -> None:
        """Execute the command ``pause``, ``resume`` or ``reset``."""

    @property
    @abstractmethod
    def stall_reason(self) -> str:
        """The reason why the main loop is stuck; empty while the loop runs. Callable in any thread."""

    @abstractmethod
    def interrupt(self) -> None:
        """Stop the rules that are running in this loop. Callable in any thread."""

    @abstractmethod
    def list_components(self) -> Sequence[tuple[str, str, bool]]:
        """Return, for each component that clients may stop: name, description, whether it is active."""

    @abstractmethod
    def set_component_active(self, name: str, *, is_active: bool) -> None:
        """Start or stop a component; no effect if the component is in the requested state already.

        :raises CxbridgeError: if the component is unknown, or cannot be started or stopped.
        """

    def read_frames(self) -> Mapping[str, str | None]:
        """Return the parent of each coordinate frame; the first call subscribes to the transforms."""
        if self._transform_listener is None:
            from cxbridge.space.tf.listener import TransformListener  # noqa: PLC0415 - few clients request frames

            self._transform_listener = TransformListener(self.board, owner=_OWNER)
        return self._transform_listener.buffer.frames

    def explain(self, name: str, kind: str, timeout_s: float) -> dict[str, Any] | None:
        """Explain a rule, a goal, an action, a fact or the run.

        Not callable in the main loop's thread, because this thread makes the explanation.

        :param kind: ``rule``, ``goal``, ``action``, ``fact`` or ``run``; empty: a rule of this name, or else
            an object of another kind.
        :returns: the members ``lines`` and ``data``; None if the time limit passes without a reply.
        :raises CxbridgeError: if the subject is unknown.
        """
        return ask_why(self.board, name, kind, _MAX_RULES, timeout_s)

    def _make_status(
        self,
        state: str,
        components: list[dict[str, Any]],
        *,
        now_us: int | None = None,
        endpoints: Sequence[str] = (),
        error: str = "",
    ) -> dict[str, Any]:
        """Return the members of a status that daemons and runs share.

        :param state: the state of the process, such as ``RUNNING``.
        :param components: the statuses of the components.
        :param now_us: the time of the status; None for the current time of the clock.
        :param endpoints: the addresses at which the process serves clients.
        :param error: the reason why a component does not work; empty without such a component.
        """
        clock, loop = self._run.clock, self._run.loop
        return {
            "state": state,
            "version": __version__,
            "pid": os.getpid(),
            "started_us": self._start_us,
            "now_us": clock.now_us() if now_us is None else now_us,
            "clock": clock.name,
            "endpoints": list(endpoints),
            "error": error,
            "loop": {"count": loop.cycle_count, "period_us": loop.period_us},
            "components": components,
        }
