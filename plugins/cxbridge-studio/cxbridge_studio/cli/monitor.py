"""``cxbridge monitor``: the terminal view of a daemon or a recorded run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.connect import DEFAULT_URL, Connect, InterfaceDirs, connect
from cxbridge.cli.entry import handle_signals

if TYPE_CHECKING:
    from cxbridge_studio.monitor.snapshot import MonitorSource


@handle_signals()
def monitor(
    run: Annotated[
        Path | None,
        typer.Argument(metavar="[RUN]", help="A recorded run of any format.", show_default=False),
    ] = None,
    url: Connect = DEFAULT_URL,
    interface_dir: InterfaceDirs = None,
) -> int:
    """Watch and control a daemon in the terminal, or scrub through a recorded run.

    Shows goals, plan-actions, skills, interfaces with their values, facts, the agenda, breakpoints and the
    log; '?' lists the keys. See docs/see.md#the-monitor. Exit status: 0 the user quit; 2 no server, or no
    recording; 130 ended by a signal.

    Example: cxbridge monitor out/run.mcap
    """
    from cxbridge.interrupt import Interrupt
    from cxbridge_studio.monitor.screen import make_monitor_app

    with Interrupt() as interrupt:
        screen = make_monitor_app(_open_source(run, url, interface_dir))
        screen.is_end_requested = lambda: interrupt.is_signalled
        interrupt.check()  # a signal during the connection ends the command before the screen appears
        screen.run()
        interrupt.check()  # after a signal the screen ends as if the user had quit: the status must be 130
    return 0


def _open_source(run: Path | None, url: str, interface_dir: list[Path] | None) -> MonitorSource:
    """Return the source of the screen's contents.

    :raises CxbridgeError: if there is no daemon or no recording.
    """
    from cxbridge_studio.monitor.snapshot import ViewQuery

    if run is not None:
        from cxbridge_studio.monitor.recorded import RecordedSource

        return RecordedSource(run)
    from cxbridge_studio.monitor.live import DaemonSource

    source = DaemonSource(url, lambda: connect(url, interface_dir))
    # raises the error about a missing daemon now, since the screen would hide the error
    source.take_snapshot(ViewQuery())
    return source
