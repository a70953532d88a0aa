"""Writes pages about runs of an exploration.

A run is played again for its page, except a counterexample, which has a recording already.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError
from cxbridge.file_access import write_file
from cxbridge.run.explainers import make_explainer
from cxbridge.run.options import RunOptions
from cxbridge.run.pages import VIEWS
from cxbridge.trace.formats.registry import open_run
from cxbridge_explore.counterexample import Counterexample
from cxbridge_explore.counterexample_playing import play_run
from cxbridge_explore.graph import Graph
from cxbridge_explore.map.rows import MERGED, OPEN, MapRow
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worlds.points import PathChooser
from cxbridge_explore.worlds.run import MakeAssembly

# The maximum number of runs that get a page: first the runs that violate a property, then the runs with the
# fewest faults. Each run is played again, which takes a second.
MAX_PAGES: Final = 25


def write_run_pages(
    graph: Graph,
    rows: Sequence[MapRow],
    page: Path,
    options: RunOptions,
    world: WorldModel | None,
    make_assembly: MakeAssembly,
) -> dict[int, str]:
    """Play at most :data:`MAX_PAGES` runs again and write a page of each, in a folder next to ``page``.

    :param page: the page of the exploration.
    :returns: the address of the page of each chosen run, relative to the page of the exploration, by the
        number of the run's row. The page opens at the last unusual choice of the run.
    :raises CxbridgeError: if a run cannot be played or a page cannot be written.
    :raises OSError: if the folder cannot be made.
    """
    folder = page.with_suffix(".runs")
    folder.mkdir(exist_ok=True)
    ended_row_numbers = [number for number, row in enumerate(rows) if row.outcome not in {MERGED, OPEN}]
    ended_row_numbers.sort(key=lambda number: (not rows[number].violations, rows[number].faults, number))
    addresses: dict[int, str] = {}
    for number in sorted(ended_row_numbers[:MAX_PAGES]):
        row = rows[number]
        path = graph.find_path(row.edge)
        with TemporaryDirectory(prefix="cxbridge-run-") as scratch:
            recording = Path(scratch, f"run-{number}.mcap")
            # without properties, since a run would stop at its first violation
            played_run = play_run(
                options, (), PathChooser(path), recording, world=world, make_assembly=make_assembly
            )
            title = row.path[-1] if row.path else "the usual run"
            _write_report(recording, title, folder / f"run-{number}.html")
        time_us = played_run.start_us + round(row.begin_s * MICROSECONDS)
        fragment = f"#/timeline?time={time_us}" if row.path else ""
        addresses[number] = f"{folder.name}/run-{number}.html{fragment}"
    return addresses


def write_violation_pages(
    counterexamples: Mapping[str, Counterexample], page: Path
) -> dict[str, dict[str, str]]:
    """Write a page about each counterexample.

    :param page: the page of the exploration.
    :returns: by property, the ``story`` of the counterexample, a sentence, and the ``address`` of its page
        relative to the page of the exploration.
    :raises CxbridgeError: if a recording cannot be read or a page cannot be written.
    """
    stories = {}
    for name, example in counterexamples.items():
        file = example.recording.with_suffix(".html")
        _write_report(example.recording, f"{name}: {example.description}", file)
        address = Path(os.path.relpath(file, page.parent)).as_posix()
        stories[name] = {"address": address, "story": _find_headline(example)}
    return stories


def _write_report(recording: Path, title: str, file: Path) -> None:
    """Write the page of a recorded run."""
    make_report = VIEWS.load_target(VIEWS.find("report"))
    write_file(file, make_report(open_run(recording), title).encode("utf-8"))


def _find_headline(example: Counterexample) -> str:
    """Return the first sentence of the story of a counterexample; empty without an explanation."""
    try:
        headline: str = make_explainer(open_run(example.recording))("run", "")["data"]["headline"]
    except CxbridgeError:  # e.g. no installed plug-in explains runs
        return ""
    return headline
