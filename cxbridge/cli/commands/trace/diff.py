"""``cxbridge trace diff``: compare recorded runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.console import say, say_result
from cxbridge.cli.option_groups import option_groups

if TYPE_CHECKING:
    from cxbridge.trace.compare.render.text import ComparisonReport
    from cxbridge.trace.compare.selection import Selection


@dataclass(frozen=True, kw_only=True)
class _ComparisonOptions:
    """The options that select the events, and how they are compared."""

    level: Annotated[str, typer.Option(help="The events to compare.")] = "transitions"
    order: Annotated[
        str,
        typer.Option(
            help="Compare all events in one order (total), or only causes before effects (partial)."
        ),
    ] = "total"
    only: Annotated[
        tuple[str, ...],
        typer.Option(metavar="PATTERN", help="Compare only matching events; may be given several times."),
    ] = ()
    ignore: Annotated[
        tuple[str, ...],
        typer.Option(metavar="PATTERN", help="Ignore matching events; may be given several times."),
    ] = ()
    time_tolerance: Annotated[
        float | None,
        typer.Option(
            min=0,
            metavar="S",
            help="Also compare the times since the previous event of the same goal, plan, Skiller or "
            "interface, with a tolerance of S seconds.",
        ),
    ] = None

    def to_json(self) -> dict[str, Any]:
        """Return the selection and the tolerance for JSON."""
        return {
            "only": [*self.only],
            "ignore": [*self.ignore],
            "time_tolerance": self.time_tolerance,
        }


@dataclass(frozen=True, kw_only=True)
class _DiffOutputs:
    """The options for the output of a comparison."""

    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False
    junit: Annotated[Path | None, typer.Option(metavar="FILE", help="Also write a JUnit file for CI.")] = None
    html: Annotated[
        Path | None, typer.Option("--html", metavar="FILE", help="Also write a page that works offline.")
    ] = None


@option_groups
def diff(
    first_path: Annotated[Path, typer.Argument(metavar="A", help="The run to compare.")],
    other_paths: Annotated[list[Path], typer.Argument(metavar="B...", help="The runs to compare with A.")],
    options: _ComparisonOptions,
    outputs: _DiffOutputs,
) -> None:
    """Compare recorded runs. Exit status: 0 equal; 1 different; 2 a run is unreadable.

    With several runs B, A must equal each of them. In partial order, the events of a goal and of its
    sub-goals must have the order that they have in the runs B, unless the runs B differ in this order.

    Example: cxbridge trace diff out/a.mcap out/b.mcap --level rules --order partial
    """
    from cxbridge.event_kinds import View
    from cxbridge.trace.compare.model import Order, parse_choice
    from cxbridge.trace.compare.render.junit import write_junit
    from cxbridge.trace.compare.render.text import make_report
    from cxbridge.trace.compare.runs import compare_runs
    from cxbridge.trace.compare.selection import Selection
    from cxbridge.trace.compare.side_by_side import page_report
    from cxbridge.trace.formats.registry import open_run

    _check_outputs((first_path, *other_paths), outputs.junit, outputs.html)
    view, order = parse_choice(View, "--level", options.level), parse_choice(Order, "--order", options.order)
    selection = Selection(options.only, options.ignore)
    run, other_runs = open_run(first_path), [open_run(path) for path in other_paths]
    comparison = compare_runs(
        run, other_runs, view, order, selection=selection, tolerance_s=options.time_tolerance
    )
    report = make_report(comparison, run, other_runs, selection)
    if outputs.html is not None:
        _write_page(outputs.html, page_report(report, options.to_json(), selection))
    if outputs.junit is not None:
        write_junit(outputs.junit, report)
    _print_comparison(report, options.to_json(), as_json=outputs.as_json)
    for warning in _list_warnings(report, selection):
        say(warning, err=True)
    if not comparison.same:
        raise typer.Exit(1)


def _check_outputs(runs: tuple[Path, ...], *outputs: Path | None) -> None:
    """Check that outputs do not overwrite a compared run."""
    for output in outputs:
        # samefile also detects the same file by another path or link
        if (
            output is not None
            and output.exists()
            and any(run.exists() and output.samefile(run) for run in runs)
        ):
            raise typer.BadParameter(f"'{output}' is one of the runs")


def _print_comparison(report: ComparisonReport, options_object: dict[str, Any], *, as_json: bool) -> None:
    """Print the comparison.

    :param options_object: the options of the comparison, for JSON.
    """
    from cxbridge.trace.compare.render.json import report_to_json
    from cxbridge.trace.compare.render.text import text_report

    say_result(report_to_json(report, options_object), text_report(report), as_json=as_json, indent=None)


def _write_page(path: Path, document: dict[str, Any]) -> None:
    """Write the comparison as a page."""
    from cxbridge.run.pages import write_document

    title = " and ".join(Path(document[side]["path"]).name for side in ("a", "b"))
    write_document(path, "comparison", title, document)


def _list_warnings(report: ComparisonReport, selection: Selection) -> Iterator[str]:
    """Yield the notes of the readers about A and the reported B, then the patterns that match no event."""
    for _, run, _ in report.sides:
        yield from (f"{run.path}: {note}" for note in run.notes)
    yield from (f"pattern '{pattern}' matches no event" for pattern in selection.unused_patterns)
