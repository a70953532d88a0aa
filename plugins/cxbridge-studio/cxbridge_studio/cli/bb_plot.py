"""``cxbridge bb plot``: plots fields of an interface over time, in the terminal."""

from __future__ import annotations

import re
import shutil
import sys
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from cxbridge.cli.connect import DEFAULT_URL, TIMED_OUT, Connect, InterfaceDirs, Uid, connect
from cxbridge.cli.console import say
from cxbridge.printing import one_line, unfiltered_stream
from cxbridge_studio.terminal.metering import OWNER, draw_plot

if TYPE_CHECKING:
    from cxbridge.blackboard.following import Deadline, Feed, InterfaceChange

_FRAME_PERIOD_S: Final = 0.1  # the time between two drawings
_MAX_POINTS: Final = 100_000  # the limit of kept points of a field, which bounds the memory
# a field is NAME or NAME[INDEX]
_FIELD_PATTERN: Final = re.compile(r"(\w+)(?:\[(\d{1,9})\])?\Z")
# escape sequences of terminals; the plot is on the alternative screen, so that the shell's text stays
_ENTER_SCREEN: Final = "\x1b[?1049h\x1b[?25l"
_LEAVE_SCREEN: Final = "\x1b[?25h\x1b[?1049l"
_CURSOR_HOME: Final = "\x1b[H"
_CLEAR_LINE: Final = "\x1b[K"
_CLEAR_BELOW: Final = "\x1b[J"


def plot(
    uid: Uid,
    fields: Annotated[
        list[str],
        typer.Argument(
            metavar="FIELD...",
            help="Numeric fields to plot: NAME, or NAME[INDEX] for an element of an array.",
        ),
    ],
    url: Connect = DEFAULT_URL,
    interface_dir: InterfaceDirs = None,
    span: Annotated[float, typer.Option(min=0.1, metavar="SECONDS", help="Time span of the plot.")] = 30.0,
    count: Annotated[int | None, typer.Option(min=1, help="End after N writes.")] = None,
    timeout: Annotated[float | None, typer.Option(min=0, help="End after SECONDS.")] = None,
    lines: Annotated[
        bool, typer.Option("--lines", help="Print lines instead of a plot on a terminal, too.")
    ] = False,
) -> int:
    """Plot fields of an interface, live. Ends with Ctrl-C.

    Without a terminal, and with --lines, prints a line for each write: the seconds since the start, then the
    values, separated by tabs. Booleans are 0 and 1, enums their numbers. Exit status: 0 after --count writes
    or without --count; 3 when --timeout came first; 130 after Ctrl-C.

    Example: cxbridge bb plot Position3DInterface::Pose translation[0] translation[1]
    """
    from cxbridge.blackboard import parse_uid
    from cxbridge.blackboard.following import Deadline, Feed

    with connect(url, interface_dir) as board, Feed(board, OWNER) as feed:
        instance = feed.open(*parse_uid(uid))
        initial = feed.read_state(instance)
        for name in fields:
            read_number(name, initial.values)  # reports a mistake before the screen changes
        writes = _follow_writes(feed, initial, Deadline(timeout))
        if lines or not sys.stdout.isatty():
            write_count = _print_writes(writes, fields, count)
        else:
            write_count = _draw_writes(writes, uid, fields, span, count)
    return 0 if count is None or write_count >= count else TIMED_OUT


def read_number(field: str, values: Mapping[str, Any]) -> float:
    """Return a field, or an element of an array, as a number.

    :raises BlackBoardError: if there is no such field or element, or the value is text.
    """
    from cxbridge.errors import BlackBoardError
    from cxbridge.suggestions import did_you_mean

    match = _FIELD_PATTERN.match(field)
    value = values.get(match[1]) if match else None
    if match is None or value is None:
        raise BlackBoardError(
            f"there is no field '{field}'",
            hint=did_you_mean(field, list(values), f"there are: {', '.join(values)}"),
        )
    if isinstance(value, list | tuple):
        index = int(match[2]) if match[2] else -1
        if not 0 <= index < len(value):
            raise BlackBoardError(
                f"the field '{match[1]}' is an array",
                hint=f"plot an element: {match[1]}[0] to {match[1]}[{len(value) - 1}]",
            )
        value = value[index]
    elif match[2]:
        raise BlackBoardError(f"'{match[1]}' is not an array", hint=f"omit the index: {match[1]}")
    if isinstance(value, Enum):
        value = value.value
    if not isinstance(value, int | float):
        raise BlackBoardError(f"'{field}' is text, which cannot be plotted", hint="'bb watch' prints it")
    return float(value)


def _follow_writes(
    feed: Feed, initial: InterfaceChange, deadline: Deadline
) -> Iterator[tuple[float, Mapping[str, Any] | None]]:
    """Yield the seconds since the start and the values of each write, until the deadline.

    The values are None if there was no write for the time of a frame: the plot then only moves on.
    """
    from cxbridge.blackboard.following import Deadline

    begin_s = time.monotonic()
    if initial.time_us:  # 0 means that the interface has never been written
        yield 0.0, initial.values
    while (remaining_s := deadline.remaining_s()) != 0:
        change = feed.wait_for_change(
            Deadline(_FRAME_PERIOD_S if remaining_s is None else min(_FRAME_PERIOD_S, remaining_s))
        )
        seconds = time.monotonic() - begin_s
        if change is None:
            yield seconds, None
        elif change.kind == "data":
            yield seconds, change.values


def _print_writes(
    writes: Iterator[tuple[float, Mapping[str, Any] | None]], fields: Sequence[str], count: int | None
) -> int:
    """Print a line for each write, and return the number of writes."""
    printed_count = 0
    for seconds, values in writes:
        if values is not None:
            numbers = (f"{read_number(name, values):g}" for name in fields)
            say("\t".join([f"{seconds:.3f}", *numbers]), flush=True)
            printed_count += 1
        if printed_count == count:
            break
    return printed_count


def _draw_writes(
    writes: Iterator[tuple[float, Mapping[str, Any] | None]],
    uid: str,
    fields: Sequence[str],
    span_s: float,
    count: int | None,
) -> int:
    """Draw a plot for each field, one below the other, and return the number of writes."""
    points: dict[str, deque[tuple[float, float]]] = {name: deque(maxlen=_MAX_POINTS) for name in fields}
    terminal, write_count, last_frame_s = unfiltered_stream(sys.stdout), 0, -_FRAME_PERIOD_S
    terminal.write(_ENTER_SCREEN)
    try:
        for seconds, values in writes:
            if values is not None:
                write_count += 1
                for name in fields:
                    points[name].append((seconds, read_number(name, values)))
            if seconds - last_frame_s >= _FRAME_PERIOD_S:
                last_frame_s = seconds
                size = shutil.get_terminal_size()
                screen = make_screen_lines(uid, points, seconds, span_s, (size.columns, size.lines))
                # lines are overwritten, since a cleared screen would flicker
                terminal.write(
                    _CURSOR_HOME + "\n".join(f"{line}{_CLEAR_LINE}" for line in screen) + _CLEAR_BELOW
                )
                terminal.flush()
            if write_count == count:
                break
    finally:
        terminal.write(_LEAVE_SCREEN)
        terminal.flush()
    return write_count


def make_screen_lines(
    uid: str,
    points: Mapping[str, Sequence[tuple[float, float]]],
    now_s: float,
    span_s: float,
    size: tuple[int, int],
) -> list[str]:
    """Return the lines of a screen with a plot of each field.

    :param points: the seconds and the value of each write, by field.
    :param size: the columns and lines of the screen.
    """
    columns, rows = size
    # The last line of the screen has a hint. Each plot has three lines besides the drawing: the title, and
    # the two lines of the axis.
    height = max(2, (rows - 1) // len(points) - 3)
    screen = []
    for name, all_points in points.items():
        visible_points = [point for point in all_points if point[0] >= now_s - span_s]
        if not visible_points and all_points:
            # the field keeps its last value, which the plot shows as a horizontal line
            visible_points = [(now_s - span_s, all_points[-1][1])]
        value = f"{all_points[-1][1]:g}" if all_points else "not written yet"
        if visible_points:
            visible_points.append((now_s, visible_points[-1][1]))
        screen.append(one_line(f"{uid} {name} = {value}")[:columns])
        screen += draw_plot(visible_points, columns, height, span_s)
    return [*screen[: rows - 1], "Ctrl-C ends"]
