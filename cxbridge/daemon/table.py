"""The components that only daemons have, in the order of their start; the components of runs follow."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

from cxbridge.plugins import Row

if TYPE_CHECKING:
    from cxbridge.daemon.settings import DaemonSettings

_PACKAGE = "cxbridge.daemon"


class _DaemonContext(Protocol):
    """The part of a daemon that the conditions below read."""

    settings: DaemonSettings


def _is_recording(context: _DaemonContext) -> bool:
    settings = context.settings
    return bool(settings.trace or settings.log or settings.bblog)


def _has_endpoints(context: _DaemonContext) -> bool:
    return bool(context.settings.endpoints)


DAEMON_COMPONENTS: Final = (
    Row("blackboard", f"{_PACKAGE}.components:BlackBoardComponent"),
    Row("recorder", f"{_PACKAGE}.components:DaemonRecorder", _is_recording),
    Row("zmq", f"{_PACKAGE}.zmq_component:ZmqComponent", _has_endpoints),
)
