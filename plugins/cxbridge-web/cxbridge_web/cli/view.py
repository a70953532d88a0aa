"""`cxbridge view`: the page over recorded runs, without a daemon."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Final

import typer

from cxbridge.cli.console import ConsoleOptions
from cxbridge.cli.entry import orderly
from cxbridge.cli.option_groups import option_groups
from cxbridge_web.options import BrowserOptions

_REST_S: Final = 0.1  # seconds between two looks for Ctrl-C


@option_groups
@orderly(service=True)
def view(
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="RUN...", help="Recorded runs of any format: mcap, Fawkes' logs, bblogger's."),
    ],
    browser: BrowserOptions,
    console: ConsoleOptions,
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="PORT", help="Serve there; 0: any free port.")
    ] = 0,
) -> int:
    """Open recorded runs on the web page, until Ctrl-C. No daemon is needed.

    Serves the page and these runs, no other file, on this machine only. Of two runs the page shows where they
    part, side by side, as `trace diff --order partial` finds it; of more it lets you choose. Exit status: 0
    ended by Ctrl-C; 2 a run cannot be read, or the port is taken.

    Example: cxbridge view out/run.mcap
    """
    from cxbridge.clock import RealClock
    from cxbridge.events import EventBus, LogLine
    from cxbridge.interrupt import Interrupt
    from cxbridge_web.guard import Guard
    from cxbridge_web.http.recordings import RecordingsApp
    from cxbridge_web.http.serving import HttpThread
    from cxbridge_web.settings import WebSettings

    bus = EventBus(RealClock())
    bus.subscribe(console.log(), LogLine)
    settings = WebSettings(port=port)
    recordings = RecordingsApp(runs)
    server = HttpThread(settings, bus.logger("Web"))
    with Interrupt(service=True) as interrupt:
        try:
            server.start(Guard(recordings, settings))
            browser.announce(f"{server.url}{recordings.start}")
            while not interrupt.received:
                time.sleep(_REST_S)
        finally:
            server.stop()
    return 0
