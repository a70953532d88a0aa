"""Golden files: recordings of runs that developers have reviewed, and with which tests compare later runs."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.event_kinds import View
from cxbridge.file_access import replaced_file
from cxbridge.history.transitions import Transition
from cxbridge.run.pages import write_document
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.render.text import make_report, text_report
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.compare.side_by_side import page_report
from cxbridge.trace.formats.transitions_text import TransitionsText, TransitionsWriter

SUFFIX = ".transitions"
"""The suffix of golden files."""


@dataclass(frozen=True, slots=True)
class GoldenFiles:
    """The golden files of a test.

    :param folder: the folder of the files.
    :param test_name: the test's name, the default for files; empty if several tests share the run.
    :param is_update: whether to write the files instead of comparing.
    :param page_folder: the folder for pages that show a differing run next to the golden run; None: no pages.
    """

    folder: Path
    test_name: str
    is_update: bool = False
    page_folder: Path | None = None

    def file(self, name: str | None = None) -> Path:
        """Return the golden file called ``name``, by default the golden file of the test.

        :raises AssertionError: if neither the file nor the test has a name.
        """
        if not (name or self.test_name):
            raise AssertionError("several tests share this run: assert_golden needs a name for its file")
        return self.folder / f"{portable_file_name(name or self.test_name)}{SUFFIX}"

    def compare_or_write(
        self,
        name: str | None,
        transitions: Sequence[Transition],
        view: View,
        order: Order,
        *,
        tolerance_s: float | None = None,
        start_us: int = 0,
    ) -> None:
        """Compare a run with a golden file, or write the file.

        :param tolerance_s: the allowed difference between times in seconds; None: times
            are neither compared nor written.
        :param start_us: the start of the run in microseconds.
        :raises AssertionError: if the runs differ, there is no such file, or neither the file nor the test
            has a name.
        :raises TraceError: if the file cannot be read, or lacks transitions or times.
        :raises CxbridgeError: if the file cannot be written.
        """
        file = self.file(name)
        time_origin_us = None if tolerance_s is None else start_us
        if self.is_update:
            write_golden(file, transitions, time_origin_us)
            return
        if not file.exists():
            raise AssertionError(f"there is no golden file {file}: pytest --update-golden writes it")
        page = (
            None
            if self.page_folder is None
            else self.page_folder / f"{portable_file_name(f'{self.test_name} {file.stem}')}.html"
        )
        report_lines = compare_with_golden(
            file,
            transitions,
            view=view,
            order=order,
            tolerance_s=tolerance_s,
            start_us=time_origin_us,
            page=page,
        )
        if report_lines:
            raise AssertionError("\n".join(["this run differs from the golden run", *report_lines]))


def portable_file_name(text: str) -> str:
    """Return a text as a portable file name, e.g. ``test_move_a-1`` for ``test_move[a-1]``."""
    return re.sub(r"[^A-Za-z0-9._=-]+", "_", text).strip("_")


def write_golden(file: Path, transitions: Sequence[Transition], start_us: int | None = None) -> None:
    """Write a golden file, and create its folder.

    :param start_us: the start of the run in microseconds, to write times; None omits them.
    :raises CxbridgeError: if the file cannot be written.
    """
    with (
        replaced_file(file) as new_file,
        TransitionsWriter(new_file, details=True, start_us=start_us) as writer,
    ):
        for transition in transitions:
            writer.write(transition)


def compare_with_golden(
    file: Path,
    transitions: Sequence[Transition],
    *,
    view: View,
    order: Order,
    tolerance_s: float | None = None,
    start_us: int | None = None,
    page: Path | None = None,
) -> list[str]:
    """Compare a run with a golden file; return the lines of a report, empty if both runs are equal.

    :param tolerance_s: the allowed difference between times in seconds; None: times are not compared.
    :param start_us: the start of the run in microseconds; needed to compare times.
    :param page: a file for a page with both runs side by side, written if they differ; None: no page.
    :raises TraceError: if the file cannot be read, has no transitions, or has no times although the
        comparison needs times.
    """
    with tempfile.TemporaryDirectory(prefix="cxbridge-golden-") as folder:
        run_file = Path(folder, "this run")
        write_golden(run_file, transitions, start_us)
        # both runs are read from files of one format: properties that the format omits cannot differ
        run, golden = TransitionsText(run_file), TransitionsText(file)
        if not any(True for _ in golden):  # the format gives its transitions by iteration only
            raise TraceError("holds no transitions", file=file, hint="write it with pytest --update-golden")
        if tolerance_s is not None and not golden.has_times():
            raise TraceError("holds no times", file=file, hint="write it with pytest --update-golden")
        comparison = compare_runs(run, [golden], view, order, tolerance_s=tolerance_s)
        if comparison.same:
            return []
        report = make_report(comparison, run, [golden])
        lines = [line.replace(str(run_file), "this run") for line in text_report(report)]
        if page is not None:
            lines.append(_write_page(page, file.stem, page_report(report)))
        return lines


def _write_page(page: Path, name: str, document: dict[str, Any]) -> str:
    """Write a page; return a line with its path, or with the reason for a failure."""
    document["a"]["path"] = "this run"  # a is the first of the two runs, read from a temporary file
    try:
        write_document(page, "comparison", f"{name}: this run and the golden one", document)
    except CxbridgeError as error:
        return f"no page shows both runs: {error}"
    return f"both runs side by side: {page}"
