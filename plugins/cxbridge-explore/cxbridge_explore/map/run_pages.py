"""Writes pages about the counterexamples of an exploration."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import write_file
from cxbridge.run.explainers import explainer
from cxbridge.run.pages import VIEWS
from cxbridge.trace.formats.registry import open_run
from cxbridge_explore.counterexample import Counterexample


def write_violation_pages(
    counterexamples: Mapping[str, Counterexample], page: Path
) -> dict[str, dict[str, str]]:
    """Write a page about each counterexample.

    :param page: the page of the exploration.
    :returns: by property, the ``story`` of the counterexample, a sentence, and the ``address`` of its page
        relative to the page of the exploration.
    """
    make_report = VIEWS.load_target(VIEWS.find("report"))
    stories = {}
    for name, example in counterexamples.items():
        run = open_run(example.recording)
        file = example.recording.with_suffix(".html")
        write_file(file, make_report(run, f"{name}: {example.description}").encode("utf-8"))
        address = Path(os.path.relpath(file, page.parent)).as_posix()
        stories[name] = {"address": address, "story": _find_headline(example)}
    return stories


def _find_headline(example: Counterexample) -> str:
    """Return the first sentence of the story of a counterexample; empty if no plug-in explains runs."""
    try:
        headline: str = explainer(open_run(example.recording))("run", "")["data"]["headline"]
    except CxbridgeError:
        return ""
    return headline
