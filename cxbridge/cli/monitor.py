"""``cxbridge monitor``: a daemon's goals, plans, skills, interfaces and log in the terminal, live."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from cxbridge.cli.connect import DEFAULT_URL, Connect, connect
from cxbridge.errors import CxbridgeError

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard

_ANSWER_S: Final = 5.0
_STEPS: Final = ("rule", "loop", "transition")


class DaemonSource:
    """A daemon, as the monitor sees it. For one thread at a time.

    :param board: its blackboard.
    """

    def __init__(self, board: BlackBoard) -> None:
        self._board = board

    def look(self, since: int) -> dict[str, Any]:
        """Return how it stands: ``status``, ``where``, ``state`` and ``interfaces``.

        :param since: the last log line that is known.
        :raises CxbridgeError: when it cannot be reached, or has no executive.
        """
        from cxbridge.app.daemon_client import read_status, request

        return {
            "status": read_status(self._board),
            "where": request(self._board, "where", _ANSWER_S),
            "state": request(self._board, "state", _ANSWER_S, since=since),
            "interfaces": self._interfaces(),
        }

    def _interfaces(self) -> Sequence[tuple[str, str, str]]:
        return [
            (f"{info.type}::{info.id}", info.writer if info.has_writer else "-", str(len(info.readers)))
            for info in self._board.list_all()
        ]

    def do(self, what: str) -> None:
        """Carry out ``pause``, ``resume`` or a step of the rules.

        :raises CxbridgeError: when it cannot be reached, or refuses.
        """
        from cxbridge.app.daemon_client import command, request

        if what in _STEPS:
            request(self._board, "step", _ANSWER_S, what=what)
        elif not command(self._board, what.capitalize(), _ANSWER_S):
            raise CxbridgeError(f"the daemon did not {what} within {_ANSWER_S:g} s")


def monitor(url: Connect = DEFAULT_URL) -> int:
    """Watch a daemon in the terminal, pause, resume and step it.

    Goals, plan-actions, skills, interfaces and log, live; keys are shown at the bottom. Needs the extra
    'monitor'. See docs/monitor.md.
    """
    try:
        from cxbridge.cli.monitor_app import MonitorApp
    except ModuleNotFoundError as error:
        raise CxbridgeError(
            f"the package '{error.name}' is not there", hint="pip install 'cxbridge[monitor]'"
        ) from None
    with connect(url, None) as board:
        source = DaemonSource(board)
        source.look(0)  # what is wrong is told now, not on a screen of its own
        MonitorApp(source, url).run()
    return 0
