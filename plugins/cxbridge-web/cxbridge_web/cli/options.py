"""The options of commands that serve the web page, and what they do about its address."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.console import say
from cxbridge.errors import CxbridgeError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cxbridge.daemon.servers.run_watch import RunServer
    from cxbridge.events import Sink
    from cxbridge.run.assembly import Assembly
    from cxbridge.run.options import RunOptions
    from cxbridge.run.result import RunResult
    from cxbridge_web.foxglove.options import FoxgloveOptions
    from cxbridge_web.settings import WebSettings

_MOST_PORT = 65_535


def has_desktop(platform: str = sys.platform, environ: Mapping[str, str] = os.environ) -> bool:
    """Whether a browser would have a window of its own; in the terminal it would be in the way."""
    return platform in {"darwin", "win32"} or bool(environ.get("DISPLAY") or environ.get("WAYLAND_DISPLAY"))


@dataclass(frozen=True, kw_only=True)
class BrowserOptions:
    """Whether a browser is opened."""

    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address of the page, and open no browser.")
    ] = False

    def announce(self, url: str) -> None:
        """Print the address of the page, and open it in a browser if a person sits at the terminal."""
        say(f"The page is at {url}", err=True, flush=True)
        if not self.no_browser and sys.stderr.isatty() and has_desktop():
            import threading
            import webbrowser

            # some browsers take seconds to report that they have been started
            threading.Thread(target=webbrowser.open, args=(url,), name="browser", daemon=True).start()


@dataclass(frozen=True, kw_only=True)
class PortOptions:
    """Whether there is a page, and where.

    :param web: the port; empty: it was not said; None: no page.
    """

    web: Annotated[
        str | None,
        typer.Option(
            metavar="[PORT]",
            help="Serve the web page on this machine: at PORT, or 8088, or a free port if that is taken.",
            show_default=False,
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class WebOptions(PortOptions, BrowserOptions):
    """The page of what the command runs."""

    @property
    def port(self) -> int | None:
        """The port that was asked for; None when none was."""
        if not self.web:
            return None
        if not (self.web.isascii() and self.web.isdecimal() and int(self.web) <= _MOST_PORT):
            raise CxbridgeError(f"--web cannot be at port '{self.web}'", hint="0 to 65535; 0: any free one")
        return int(self.web)

    def settings(self) -> WebSettings:
        """Return the settings of a server of this machine.

        :raises CxbridgeError: when the port is none.
        """
        from cxbridge_web.settings import DEFAULT_PORT, WebSettings

        port = self.port
        if port is None:
            port = DEFAULT_PORT if is_free(DEFAULT_PORT) else 0
        return WebSettings(port=port)


def is_free(port: int) -> bool:
    """Whether a server of this machine could be at a port."""
    import socket

    with socket.socket() as attempt:
        attempt.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            attempt.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


def has_pressed_enter() -> bool:
    """Whether somebody at the terminal has pressed Enter; a script has not."""
    if not sys.stdin.isatty():
        return False
    ready, _, _ = select.select([sys.stdin], [], [], 0)
    return bool(ready) and sys.stdin.readline() is not None


def _servers(web: WebOptions, foxglove: FoxgloveOptions) -> Iterator[RunServer]:
    """Yield what serves a run to those who watch it.

    :raises CxbridgeError: when a port is none.
    """
    if web.web is not None:
        from cxbridge_web.servers.run_web import RunPage

        yield RunPage(web.settings(), web.announce)
    if foxglove.foxglove_port is not None:
        from cxbridge_web.foxglove.settings import FoxgloveSettings
        from cxbridge_web.servers.run_foxglove import RunFoxglove

        settings = FoxgloveSettings(port=foxglove.foxglove_port)
        yield RunFoxglove(settings, lambda url: say(f"Foxglove connects to {url}", err=True, flush=True))


def run_watched(
    options: RunOptions,
    web: WebOptions,
    foxglove: FoxgloveOptions,
    log: Sink,
    attach: Callable[[Assembly], None],
    show: Callable[[RunResult], None],
) -> int:
    """Run a scenario so that it can be watched, on its page or in Foxglove; returns the run's exit status.

    :param show: prints the result; what serves the run stays there afterwards.
    :raises CxbridgeError: when the options do not go together.
    """
    from dataclasses import replace

    from cxbridge.daemon.servers.run_watch import RunWatch
    from cxbridge.run import run_scenario

    given, what = ("--foxglove", "Foxglove") if web.web is None else ("--web", "The page")
    if options.replay:
        raise CxbridgeError(
            f"{given} cannot go with --replay", hint="record the replay with --trace, and look at that"
        )

    def end(result: RunResult) -> None:
        show(result)
        how = "Enter or Ctrl-C ends" if sys.stdin.isatty() else "Ctrl-C ends"
        say(f"{what} stays {'open' if web.web is not None else 'connected'}: {how}", err=True, flush=True)

    watch = RunWatch(tuple(_servers(web, foxglove)), end, has_pressed_enter)
    if options.clock is None:
        options = replace(options, clock="real")
    return run_scenario(options, log, attach, interactive=True, company=watch).status
