"""What cxbridge has beyond Fawkes: how the daemon stands, and telling it what to do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cxbridge.web.clipsview import census
from cxbridge.web.endpoint import API_VERSION, Call, Endpoint

if TYPE_CHECKING:
    from cxbridge.web.events import EventStreams
    from cxbridge.web.taps import Taps


class Figures:
    """What the server knows of itself.

    :param streams: who follows.
    :param taps: counts the firings of rules while somebody follows them.
    """

    def __init__(self, streams: EventStreams, taps: Taps) -> None:
        self.streams = streams
        self.taps = taps

    def plain(self) -> dict[str, int]:
        """Return it as JSON can have it."""
        streams = self.streams
        return {"clients": streams.clients, "events": streams.count, "dropped": streams.dropped}


def endpoints(figures: Figures) -> Sequence[Endpoint]:
    """Return the endpoints below ``/api/cxbridge``."""

    def status(call: Call) -> dict[str, Any]:
        return {
            "kind": "Status",
            "apiVersion": API_VERSION,
            **call.host.status(),
            "remote_control": call.host.remote_control,
            "environments": [
                {"name": name, **census(env)} for name, env in sorted(call.host.environments().items())
            ],
            "web": figures.plain(),
        }

    def command(what: str) -> Endpoint:
        def carry_out(call: Call) -> dict[str, Any]:
            call.host.command(what)
            return status(call)

        about = {
            "pause": "Deactivate the components that work.",
            "resume": "Activate what is inactive.",
            "reset": "Take the components that work down, and start them anew.",
        }
        return Endpoint(
            method="POST",
            path=f"/cxbridge/{what}",
            handler=carry_out,
            about=about[what],
            reply="Status",
            changes=True,
        )

    return (
        Endpoint(
            method="GET",
            path="/cxbridge/status",
            handler=status,
            about="How the daemon and its components stand.",
            reply="Status",
        ),
        *(command(what) for what in ("pause", "resume", "reset")),
    )
