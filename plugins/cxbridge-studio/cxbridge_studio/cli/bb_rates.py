"""``cxbridge bb hz``: measures the writes to interfaces per second."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.connect import (
    DEFAULT_URL,
    TIMED_OUT,
    Connect,
    Globs,
    InterfaceDirs,
    connect,
    say_unmatched,
    split_glob,
)
from cxbridge.cli.console import say, say_json
from cxbridge.cli.option_groups import option_groups
from cxbridge_studio.write_rates import OWNER, WINDOW, Rate, RateMeter

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.blackboard.following import Deadline

NO_RATE = "fewer than two writes yet"
NO_NEW_WRITES = "no new writes"


@dataclass(frozen=True, kw_only=True)
class MeterOptions:
    """The options of a measurement."""

    window: Annotated[
        int, typer.Option(min=2, help="How many of the latest writes of each interface to measure.")
    ] = WINDOW
    every: Annotated[float, typer.Option(min=0.05, metavar="SECONDS", help="Time between two reports.")] = 1.0
    count: Annotated[int | None, typer.Option(min=1, help="End after N reports.")] = None
    timeout: Annotated[float | None, typer.Option(min=0, help="End after SECONDS.")] = None
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a JSON object for each interface and report.")
    ] = False


@option_groups
def hz(
    globs: Globs, options: MeterOptions, url: Connect = DEFAULT_URL, interface_dir: InterfaceDirs = None
) -> int:
    """Measure how often interfaces are written, as `ros2 topic hz` does. Ends with Ctrl-C.

    Each report has a line for each interface. Interfaces that appear later are measured, too. Exit status:
    0 after --count reports, or after --timeout without --count; 3 when --timeout came before --count reports;
    130 after Ctrl-C.

    Example: cxbridge bb hz SkillerInterface
    """
    from cxbridge.blackboard.following import Deadline

    deadline, report_count = Deadline(options.timeout), 0
    with connect(url, interface_dir) as board:
        say_unmatched(board, globs)
        for meters in _measure_rates(board, globs, options, deadline):
            width = max(map(len, meters), default=0)
            for uid, meter in sorted(meters.items()):
                rate, new_write_count = meter.rate(), meter.count_new_writes()
                if options.as_json:
                    size = board.registry.get(uid.partition("::")[0]).SCHEMA.datasize
                    say_json(_make_json_row(uid, rate, size) | {"new_writes": new_write_count}, flush=True)
                else:
                    # not the rate of earlier writes, which would look like the current rate
                    rate_text = _format_rate(rate) if rate is not None and new_write_count else NO_NEW_WRITES
                    say(f"{uid.ljust(width)}  {NO_RATE if rate is None else rate_text}", flush=True)
            if not meters and not options.as_json:
                say("no such interface yet", flush=True)
            report_count += 1
            if report_count == options.count:
                return 0
    return 0 if options.count is None else TIMED_OUT


def _format_rate(rate: Rate) -> str:
    return (
        f"{rate.hz:9.3f} Hz  min {rate.shortest_s:.4f} s  max {rate.longest_s:.4f} s  "
        f"std dev {rate.deviation_s:.5f} s  window {rate.window}"
    )


def _make_json_row(uid: str, rate: Rate | None, size: int) -> dict[str, Any]:
    """Return the report about an interface as a JSON object."""
    measurements = {} if rate is None else {**asdict(rate), "bytes_per_s": rate.hz * size}
    return {"uid": uid, "block_bytes": size, **measurements}


def _measure_rates(
    board: BlackBoard, globs: list[str], options: MeterOptions, deadline: Deadline
) -> Iterator[dict[str, RateMeter]]:
    """Yield the meters of the matching interfaces by uid whenever a report is due, until the deadline."""
    from cxbridge.blackboard.following import Deadline, Feed

    with Feed(board, OWNER) as feed:
        meters = {
            instance.uid: RateMeter(options.window)
            for type_glob, id_glob in map(split_glob, globs)
            for instance in feed.follow(type_glob, id_glob)
        }
        while deadline.remaining_s() != 0:
            remaining_s = deadline.remaining_s()
            report_deadline = Deadline(
                options.every if remaining_s is None else min(options.every, remaining_s)
            )
            while (change := feed.wait_for_change(report_deadline)) is not None:
                if change.kind == "data":
                    # an interface that appears later gets its meter at its first write
                    meters.setdefault(change.uid, RateMeter(options.window)).add(time.monotonic())
                # with fast writers, wait_for_change() always returns a change, never None after the deadline
                if report_deadline.remaining_s() == 0:
                    break
            yield meters
