"""The coverage of an agent by the runs of an exploration."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

from cxbridge.run.options import RunOptions
from cxbridge_explore.used_parts import UsedPart
from cxbridge_studio.check.sources import read_scenario_sources
from cxbridge_studio.explain.coverage.model import AgentSources, Coverage, RecordedUse, compute_coverage
from cxbridge_studio.explain.coverage.report import shorten_names


def compute_explored_coverage(options: RunOptions, used_parts: Iterable[UsedPart]) -> Coverage:
    """Compute the coverage of an agent by an exploration. A count is 1 for a used part, otherwise 0."""
    agent_sources, recorded_use = AgentSources(), RecordedUse()
    for source in read_scenario_sources(options):  # from the files, since an exploration has no recording
        agent_sources.add_source(source, include_core=False)
    for kind, name, detail in used_parts:
        counts = getattr(recorded_use, kind)  # the kinds are names of attributes
        if detail:  # the mode or outcome of a goal
            counts.setdefault(name, Counter())[detail] = 1
        else:
            counts[name] = 1
    return compute_coverage(agent_sources, recorded_use)


def encode_coverage(coverage: Coverage) -> dict[str, Any]:
    """Return a coverage as JSON values."""
    unfired_rules = [
        {"file": file.file, "line": rule.lines[0], "rule": rule.name}
        for file in coverage.files
        for rule, count in file.rules
        if count == 0
    ]
    return {
        "rules": {"fired": coverage.fired_count, "of": coverage.watched_count, "never": unfired_rules},
        "goals": {
            "outcomes": {name: [outcome for outcome, _ in outcomes] for name, outcomes in coverage.outcomes},
            "modes_never_reached": {name: list(modes) for name, modes in coverage.missing_modes},
            "never": list(coverage.goal_classes.unused),
        },
        "actions": {
            "executed": [name for name, _ in coverage.actions.used],
            "never": list(coverage.actions.unused),
        },
        "skills": [name for name, _ in coverage.skills.used],
    }


def describe_unreached_parts(coverage: Coverage) -> Iterable[str]:
    """Yield lines of text: the share of the rules that fired, and each unreached part."""
    yield f"{coverage.fired_count} of {coverage.watched_count} rules fired: {coverage.percent:.1f} %"
    for file_name, file in zip(shorten_names(coverage.files), coverage.files, strict=True):
        for rule, count in file.rules:
            if count == 0:
                yield f"  never fired: {file_name}:{rule.lines[0]} {rule.name}"
    for name, modes in coverage.missing_modes:
        yield f"  {name} was never {', '.join(modes)}"
    for noun, names in (("goal class", coverage.goal_classes.unused), ("action", coverage.actions.unused)):
        for name in names:
            yield f"  never: {noun} {name}"
