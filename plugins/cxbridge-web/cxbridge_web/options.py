"""Command-line options of the web page and of the server for Foxglove."""

from __future__ import annotations

import os
import sys
from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, cast

import typer

from cxbridge.cli.console import say
from cxbridge.errors import CxbridgeError
from cxbridge.listening import LOOPBACK
from cxbridge.numbers import parse_decimal
from cxbridge.run.options import PluginOptions, RunOptions, Setting
from cxbridge_web import FOXGLOVE_PORT

if TYPE_CHECKING:
    from cxbridge.run.servers import RunServer
    from cxbridge_web.settings import WebSettings

_MAX_PORT: Final = 65_535


def has_desktop() -> bool:
    """Return whether the user has a desktop. Without a desktop, a text browser would occupy the terminal."""
    return sys.platform in {"darwin", "win32"} or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))


@dataclass(frozen=True, kw_only=True)
class BrowserOptions:
    """Options for opening a browser."""

    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address of the page without opening a browser.")
    ] = False

    def announce(self, url: str) -> None:
        """Print the address of the page; without ``--no-browser``, open it from a terminal on a desktop."""
        say(f"The page is at {url}", err=True, flush=True)
        if not self.no_browser and sys.stderr.isatty() and has_desktop():
            import threading  # noqa: PLC0415 - start-up time is a feature
            import webbrowser  # noqa: PLC0415

            # webbrowser.open of some browsers returns only seconds after their start
            threading.Thread(target=webbrowser.open, args=(url,), name="browser", daemon=True).start()


class WatchOptions(PluginOptions):
    """Options for watching a run or a daemon. The port is the optional value of an option.

    Typer has no options with an optional value, so the value is a text: empty for an option without a port.
    """

    commands: ClassVar[frozenset[str]] = frozenset({"run", "daemon"})
    name: ClassVar[str]  # the name of the option with the port

    @property
    def port_text(self) -> str | None:
        """The text of the port; None without the option. The field is named like the option."""
        return cast("str | None", getattr(self, self.name.removeprefix("--")))

    @property
    def is_on(self) -> bool:
        """Whether the option is given."""
        return self.port_text is not None

    @property
    def port(self) -> int | None:
        """The given port; None for the default port.

        :raises CxbridgeError: if the value of the option is not a port.
        """
        text = self.port_text
        if not text:
            return None
        port = parse_decimal(text)
        if port is None or port > _MAX_PORT:
            raise CxbridgeError(
                f"{self.name} cannot use the port '{text}'",
                hint="use a port from 0 to 65535; 0: any free port",
            )
        return port

    @abstractmethod
    def make_server(self) -> RunServer:
        """Make the server of a run."""

    def servers(self) -> Sequence[RunServer]:
        return (self.make_server(),) if self.is_on else ()

    @property
    def needs_real_time(self) -> bool:
        """Whether a run uses the real clock by default."""
        return self.is_on

    @property
    def is_interactive(self) -> bool:
        """Whether a user may stop the rules."""
        return self.is_on

    def check(self, options: RunOptions) -> None:
        """Raise :class:`CxbridgeError` if the port is invalid or the run is a replay."""
        if self.is_on and options.replay:
            raise CxbridgeError(
                f"{self.name} cannot be used with --replay",
                hint="record the replay with --trace, and open the recording",
            )
        _ = self.port  # raises CxbridgeError for an invalid port


@dataclass(frozen=True, kw_only=True)
class WebOptions(BrowserOptions, WatchOptions):
    """Options of the page of a run or a daemon.

    :param web: the port; empty for ``--web`` without a port; None for no page.
    """

    web: Annotated[
        str | None,
        typer.Option(
            metavar="[PORT]",
            help="Serve the web page on this machine at PORT; by default at 8088, or a free port if "
            "8088 is taken.",
            show_default=False,
        ),
    ] = None

    name: ClassVar[str] = "--web"

    def make_server_settings(self) -> WebSettings:
        """Return the settings of a server on this machine.

        :raises CxbridgeError: if the value of the option is not a port.
        """
        from cxbridge_web.settings import DEFAULT_PORT, WebSettings  # noqa: PLC0415 - start-up time is a feature

        port = self.port
        if port is None:
            port = DEFAULT_PORT if is_port_free(DEFAULT_PORT) else 0
        return WebSettings(port=port)

    def make_server(self) -> RunServer:
        from cxbridge_web.servers.run_page import RunPage  # noqa: PLC0415 - start-up time is a feature

        return RunPage(self.make_server_settings(), self.announce)

    def settings(self) -> Iterable[tuple[str, Setting]]:
        if self.is_on:
            yield "web/enable", True
            if self.port is not None:
                yield "web/port", self.port


@dataclass(frozen=True, kw_only=True)
class FoxgloveOptions(WatchOptions):
    """Options of the server for Foxglove.

    :param foxglove: the port; empty for ``--foxglove`` without a port; None for no server.
    """

    foxglove: Annotated[
        str | None,
        typer.Option(
            metavar="[PORT]",
            help=f"Let Foxglove connect on this machine at PORT, by default {FOXGLOVE_PORT}; 0: any "
            "free port.",
            show_default=False,
        ),
    ] = None

    name: ClassVar[str] = "--foxglove"

    def make_server(self) -> RunServer:
        from cxbridge_web.foxglove.settings import FoxgloveSettings  # noqa: PLC0415 - start-up time is a feature
        from cxbridge_web.servers.foxglove import RunFoxglove  # noqa: PLC0415

        settings = FoxgloveSettings(port=FOXGLOVE_PORT if self.port is None else self.port)
        return RunFoxglove(settings, lambda url: say(f"Foxglove connects to {url}", err=True, flush=True))

    def settings(self) -> Iterable[tuple[str, Setting]]:
        if self.is_on:
            yield "foxglove/port", FOXGLOVE_PORT if self.port is None else self.port


def is_port_free(port: int) -> bool:
    """Return whether a server on this machine can listen at a port."""
    import socket  # noqa: PLC0415 - start-up time is a feature

    try:
        # as the server does: a port with closing connections of an earlier server counts as free
        socket.create_server((LOOPBACK, port)).close()
    except OSError:
        return False
    return True
