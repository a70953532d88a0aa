"""``cxbridge view``: the web page with recorded runs, without a daemon."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.console import ConsoleOptions
from cxbridge.cli.entry import handle_signals
from cxbridge.cli.option_groups import option_groups
from cxbridge_web.options import BrowserOptions


@option_groups
@handle_signals(is_service=True)
def view(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="Recorded runs of any format: mcap, logs of Fawkes, logs of its bblogger.",
        ),
    ],
    browser: BrowserOptions,
    console: ConsoleOptions,
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="PORT", help="The port of the page; 0: any free port.")
    ] = 0,
) -> int:
    """Open recorded runs on the web page, until Ctrl-C. No daemon is needed.

    Serves the page and these runs, but no other file, on this machine only. Two runs are shown side by side,
    with the first difference, as `trace diff --order partial` finds it; more runs are listed. Exit
    status: 0 ended by Ctrl-C; 2 a run cannot be read, or the port is taken.

    Example: cxbridge view out/run.mcap
    """
    from cxbridge.daemon.services.service import Service
    from cxbridge_web.guard import Guard
    from cxbridge_web.http.recordings import RecordingsApp
    from cxbridge_web.http.serving import HttpThread
    from cxbridge_web.settings import WebSettings

    settings, recordings = WebSettings(port=port), RecordingsApp(runs)
    with Service(console.make_log()) as service:
        server = HttpThread(settings, service.bus.logger("Web"))
        service.callback(server.stop)
        server.start(Guard(recordings, settings))
        browser.announce(f"{server.url}{recordings.start_path}")
        service.stopped.wait()
    return 0
