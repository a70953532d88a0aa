"""The prompt of ``cxbridge ros2 terminal``.

The prompt carries out a single command from the command line, the lines of a pipe, or typed lines.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from cxbridge.cli.command_lines import CommandLines
from cxbridge.cli.console import complain, say_text
from cxbridge.clock import RealClock
from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge.rights import ALL_RIGHTS
from cxbridge_ros2.experts.client import ExpertClient, ExpertRefusedError
from cxbridge_ros2.experts.definitions import TYPE_DEFINITIONS
from cxbridge_ros2.experts.nodes import NodeCodec
from cxbridge_ros2.experts.terminal import Terminal
from cxbridge_ros2.settings import NodeSettings

_PROMPT: Final = "> "
_EXIT_REFUSED: Final = 1  # exit status after an expert has refused a command
_EXIT_INVALID: Final = 2  # exit status after an unknown command, or without a server


class Prompt(Closing):
    """Joins the domain as a node, and carries out commands.

    :param settings: the settings of the node, by the keys of a configuration.
    """

    def __init__(self, settings: Mapping[str, Any]) -> None:
        node_settings = NodeSettings.parse(settings, Path(), "the terminal")
        self._node = node_settings.join(
            "cxbridge_terminal", node_settings.load_definitions(TYPE_DEFINITIONS), _print_problem, ALL_RIGHTS
        )
        self._terminal = Terminal(
            ExpertClient(self._node, RealClock(), node_settings.namespace),
            NodeCodec(node_settings.distribution),
        )

    def run(self, command: str | None) -> int:
        """Carry out one command, or all input lines; return the worst exit status."""
        if command is not None:
            return self._run_line(command)
        status = 0
        for line in _read_lines():
            status = max(status, self._run_line(line))
            if self._terminal.is_over:
                break
        return status

    def _run_line(self, line: str) -> int:
        """Carry out a command, and return the exit status."""
        try:
            for text in self._terminal.run_line(line):
                say_text(text)
        except ExpertRefusedError as error:
            complain(error)
            return _EXIT_REFUSED
        except CxbridgeError as error:
            complain(error)
            return _EXIT_INVALID
        return 0

    def close(self) -> None:
        self._node.close()


def _print_problem(text: str) -> None:
    complain(CxbridgeError(text))


def _read_lines() -> Iterator[str]:
    """Yield typed lines after a prompt, or the lines of a pipe."""
    if sys.stdin is not None and sys.stdin.isatty():
        with suppress(EOFError):
            while True:
                yield input(_PROMPT)
        return
    lines = CommandLines()
    while (line := lines.next(lambda: False)) is not None:  # no wait ends before the next line
        yield line
