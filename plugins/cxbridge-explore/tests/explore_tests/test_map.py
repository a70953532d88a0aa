"""The map of an exploration: rows, coverage and page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cxbridge.run.options import RunOptions
from cxbridge_explore.bounds import Bounds, ExecutionOptions
from cxbridge_explore.counterexample import write_counterexample
from cxbridge_explore.explore import explore
from cxbridge_explore.graph import Graph
from cxbridge_explore.map.coverage import compute_explored_coverage, encode_coverage
from cxbridge_explore.map.page import write_page
from cxbridge_explore.map.rows import OPEN, MapRow, make_run_rows
from cxbridge_explore.map.run_pages import write_run_pages, write_violation_pages
from cxbridge_explore.properties.selection import select_properties
from cxbridge_explore.result import ExploreResult
from cxbridge_explore.worlds.points import read_path
from cxbridge_explore.worlds.run import make_scenario
from explore_tests.test_explore import SCENARIO, run_explore
from tests.support import needs_plugin
from tests.trace.html.browser import needs_browser, show

OPTIONS = RunOptions(scenario=SCENARIO, skiller="none")


@pytest.fixture(scope="module")
def result() -> ExploreResult:
    """The exploration of the test scenario with one fault, by replay without forks."""
    return explore(OPTIONS, Bounds(faults=1), ExecutionOptions(fork=False, coverage=True))


def test_each_run_has_row_below_parent(result: ExploreResult) -> None:
    usual, *branches = make_run_rows(result.graph)
    assert (usual.choice, usual.outcome, usual.parent) == ("", "completed", None)
    assert {each.outcome for each in branches} == {"unsuccessful"}
    assert [each.parent for each in branches] == [0] * 4
    assert [each.begin_s for each in branches] == sorted((each.begin_s for each in branches), reverse=True)
    assert all(0 <= each.begin_s < each.end_s for each in branches)
    assert branches[0].path == (f"{branches[0].choice} at {branches[0].begin_s:.2f} s",)
    assert branches[0].choice.endswith(": fails")


def test_unexplored_row_is_open() -> None:
    (row,) = make_run_rows(Graph(1, None))
    assert row == MapRow("", 0.0, 0, None, (), outcome=OPEN)


def test_coverage_includes_all_runs(result: ExploreResult) -> None:
    coverage = encode_coverage(compute_explored_coverage(OPTIONS, result.graph.used_parts))
    assert coverage["rules"]["never"] == []
    assert coverage["rules"]["fired"] == coverage["rules"]["of"] > 20
    assert coverage["actions"]["never"] == ["lock", "unlock"]
    assert coverage["goals"]["outcomes"]["TALK"] == [
        "COMPLETED",
        "FAILED",
    ]  # FAILED comes from the runs with a fault
    assert coverage["skills"] == ["say"]


def test_forked_runs_have_coverage_of_replayed_runs(result: ExploreResult) -> None:
    forked = run_explore("test-scenario", "--coverage")["coverage"]
    assert forked == encode_coverage(compute_explored_coverage(OPTIONS, result.graph.used_parts))


@needs_plugin("web")
@needs_browser
def test_page_shows_runs_and_outcomes(result: ExploreResult, tmp_path: Path) -> None:
    file = tmp_path / "map.html"
    write_page(
        result, compute_explored_coverage(OPTIONS, result.graph.used_parts), file, "cxbridge explore <x>"
    )
    shown = show(file, tmp_path / "profile")
    assert shown.console == []
    assert "5 runs, 4 states, 0 merged; complete. 1 completed, 4 unsuccessful" in shown.dom
    assert shown.dom.count('<rect class="failed"') == 4
    assert shown.dom.count('<rect class="good"') == 1
    assert "cxbridge explore &lt;x&gt;" in shown.dom
    assert "unlock" in shown.dom


@needs_plugin("web")
@needs_browser
def test_page_of_many_runs_draws_those_with_few_faults(
    result: ExploreResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = [MapRow("", 0.0, 0, None, (), 9.0, "completed")]
    rows += [MapRow(f"a{n}: fails", 1.0, 1, 0, (f"a{n}",), 9.0, "completed") for n in range(1, 3)]
    rows += [MapRow(f"b{n}: fails", 2.0, 2, 1, ("a1", f"b{n}"), 9.0, "stuck") for n in range(800)]
    rows[-1].violations = ("run-ends: it does not",)
    monkeypatch.setattr("cxbridge_explore.map.page.make_run_rows", lambda _graph: rows)
    file = tmp_path / "map.html"
    write_page(result, compute_explored_coverage(OPTIONS, ()), file, "x")
    text = show(file, tmp_path / "profile").dom
    drawn = text.count("<rect")
    assert 0 < drawn < len(rows)
    assert f"{len(rows) - drawn} runs of {len(rows)} are not drawn" in text
    assert "a1: fails" in text
    assert "a2: fails" in text
    assert "b799: fails</text>" in text  # the run violates a property


@needs_plugin("web")
def test_unwritable_page_is_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(AssertionError, match="cannot be written: its folder cannot be made"):
        run_explore("test-scenario", "--html", tmp_path / "file" / "folder" / "map.html")


@needs_plugin("web")
@needs_browser
def test_page_shows_violation_and_opens_run_at_fault(tmp_path: Path) -> None:
    """The violation comes first; the bar of the run opens the run's page at the time of the fault."""
    file = tmp_path / "map.html"
    no_talk = "never (goal (class TALK) (outcome FAILED))"
    properties = select_properties(OPTIONS, (no_talk,))
    result = explore(OPTIONS, Bounds(faults=1), ExecutionOptions(fork=False), properties=properties)
    path = read_path(result.violations[0]["choices"])
    example = write_counterexample(OPTIONS, properties, no_talk, path, tmp_path / "found")
    rows = make_run_rows(result.graph)
    pages = write_run_pages(result.graph, rows, file, OPTIONS, None, make_scenario)
    assert set(pages) == set(range(5))
    with_example = replace(result, counterexamples={no_talk: example})
    stories = write_violation_pages(with_example.counterexamples, file)
    write_page(with_example, None, file, "cxbridge explore", run_addresses=pages, stories=stories)
    shown = show(file, tmp_path / "profile")
    assert shown.console == []
    assert shown.dom.index("The shortest run with the violation") < shown.dom.index("What faults lead to")
    assert f'href="{pages[1]}"' in shown.dom
    page, _, moment = pages[1].partition("#")
    run = show(tmp_path / page, tmp_path / "profile", fragment=f"#{moment}")
    assert run.console == []
    assert f"{rows[1].begin_s:.3f} s" in run.dom


@needs_plugin("web")
def test_exploration_writes_page_from_start(tmp_path: Path) -> None:
    drawn: list[int] = []

    def draw_page(so_far: ExploreResult) -> None:
        drawn.append(len(so_far.graph.leaves))
        write_page(so_far, None, tmp_path / "map.html", "x", is_live=True)

    explore(OPTIONS, Bounds(faults=0), ExecutionOptions(fork=False), draw_page=draw_page)
    assert drawn[0] == 0
    assert (tmp_path / "map.html").stat().st_size > 0
