"""The HTML page about an exploration: map of runs, effects of faults, unreached parts of the agent."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType

from cxbridge.run.pages import write_document
from cxbridge_explore.map.coverage import encode_coverage
from cxbridge_explore.map.rows import make_run_rows
from cxbridge_explore.result import ExploreResult
from cxbridge_studio.explain.coverage.model import Coverage


def write_page(
    result: ExploreResult,
    coverage: Coverage | None,
    file: Path,
    command: str,
    *,
    run_addresses: Mapping[int, str] = MappingProxyType({}),
    stories: Mapping[str, Mapping[str, str]] = MappingProxyType({}),
    is_live: bool = False,
) -> None:
    """Write the page.

    :param coverage: the coverage of the agent; None during the exploration.
    :param command: the command that reproduces the page, to show on the page.
    :param run_addresses: the addresses of the pages of runs, by the numbers of their rows.
    :param stories: for each property with a counterexample, its ``story``, a sentence, and the ``address`` of
        its page.
    :param is_live: whether the exploration is still running; then the page reloads itself.
    :raises CxbridgeError: if the file cannot be written, or no installed package makes pages.
    """
    rows = [asdict(row) for row in make_run_rows(result.graph)]
    for number, address in run_addresses.items():
        rows[number]["page"] = address
    document = {
        "command": command,
        "summary": _describe_result(result),
        "rows": rows,
        "properties": [{**row, **stories.get(row["name"], {})} for row in _make_property_rows(result)],
        "coverage": None if coverage is None else encode_coverage(coverage),
        "live": is_live,
    }
    write_document(file, "exploration", "Exploration", document)


def _describe_result(result: ExploreResult) -> str:
    graph = result.graph
    counts = ", ".join(f"{count} {outcome}" for outcome, count in result.outcomes.items())
    end_text = "complete" if result.is_complete else f"not complete: {graph.open_branches_text}"
    return f"{graph.counts_text}; {end_text}. {counts}"


def _make_property_rows(result: ExploreResult) -> Iterator[dict[str, str]]:
    violations_by_name = {violation["property"]: violation for violation in result.violations}
    for name in sorted({property_.name for property_ in result.properties} | violations_by_name.keys()):
        violation = violations_by_name.get(name)
        if violation is not None:
            # "words" is the sentence of the counterexample, which cycles and running explorations lack
            message = violation.get("words") or violation["message"]
            yield {"name": name, "verdict": "violated", "message": message}
        elif name in result.vacuous_names:
            yield {"name": name, "verdict": "vacuous", "message": "no run could have violated the property"}
        else:
            yield {"name": name, "verdict": "holds", "message": ""}
