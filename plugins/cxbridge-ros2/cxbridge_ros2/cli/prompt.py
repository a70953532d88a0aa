"""The prompt of ``cxbridge ros2 terminal``.

The prompt carries out a single command from the command line, the lines of a pipe, or typed lines.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
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
        for line in (
            self._read_typed_lines() if sys.stdin is not None and sys.stdin.isatty() else _read_piped_lines()
        ):
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

    def _read_typed_lines(self) -> Iterator[str]:
        """Yield typed lines, with history and completion if the terminal supports them."""
        if sys.platform != "win32":  # Windows has no readline, and its console has a history
            import readline

            # only blanks separate words, since words such as plan-file and ?robot0 have other characters
            readline.set_completer_delims(" ")
            readline.set_completer(
                lambda _text, state: self._find_completion(readline.get_line_buffer(), state)
            )
            readline.parse_and_bind("tab: complete")
        while True:
            try:
                yield input(_PROMPT)
            except EOFError:
                return

    def _find_completion(self, line: str, state: int) -> str | None:
        """Return a completion of a line; None after the last.

        :param state: the index of the completion, which readline counts up from 0.
        """
        completions = self._terminal.find_completions(line)
        return f"{completions[state]} " if state < len(completions) else None

    def close(self) -> None:
        self._node.close()


def _print_problem(text: str) -> None:
    complain(CxbridgeError(text))


def _read_piped_lines() -> Iterator[str]:
    lines = CommandLines()
    while (line := lines.next(lambda: False)) is not None:  # no wait ends before the next line
        yield line
