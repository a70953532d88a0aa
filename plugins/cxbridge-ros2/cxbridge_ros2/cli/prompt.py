"""The prompt of ``cxbridge ros2 terminal``.

The prompt carries out a single command from the command line, the lines of a pipe, or typed lines.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from cxbridge.cli.console import complain, say_text
from cxbridge.cli.input_lines import InputLines
from cxbridge.clock import RealClock
from cxbridge.errors import CxbridgeError
from cxbridge.rights import ALL_RIGHTS
from cxbridge_ros2.experts.client import ExpertClient
from cxbridge_ros2.experts.definitions import TYPE_DEFINITIONS
from cxbridge_ros2.experts.terminal import Terminal
from cxbridge_ros2.experts.trees import TreeCodec
from cxbridge_ros2.settings import NodeSettings

_PROMPT: Final = "> "


def run_terminal(settings: Mapping[str, Any], command: str | None) -> int:
    """Join the domain as a node, and carry out one command, or the input lines up to ``quit``.

    :param settings: the settings of the node, by the keys of a configuration.
    :param command: the only command; None for the input lines.
    :returns: the worst exit status of a command; 0 if all commands were carried out.
    """
    node_settings = NodeSettings.parse(settings, Path(), "the terminal")
    definitions = node_settings.load_definitions(TYPE_DEFINITIONS)
    worst_status = 0
    # all rights, since this node serves no requests of other nodes
    with node_settings.join(
        "cxbridge_terminal", definitions, lambda text: complain(CxbridgeError(text)), ALL_RIGHTS
    ) as node:
        terminal = Terminal(
            ExpertClient(node, RealClock(), node_settings.namespace), TreeCodec(node_settings.distribution)
        )
        for line in _read_lines() if command is None else [command]:
            try:
                for output_line in terminal.run_line(line):
                    say_text(output_line)
            except CxbridgeError as error:
                complain(error)
                worst_status = max(worst_status, error.exit_status)
            if terminal.is_over:
                break
    return worst_status


def _read_lines() -> Iterator[str]:
    """Yield typed lines after a prompt, or the lines of a pipe."""
    lines = InputLines()
    if lines.is_terminal:
        with suppress(EOFError):  # Ctrl-D ends the input
            while True:
                yield input(_PROMPT)
    else:
        # `next` waits for a line without a limit, and returns None at the end of the pipe
        yield from iter(lambda: lines.next(lambda: False), None)
