"""The deletion of each closing parenthesis in the shipped scenarios: does the check name the open list?

``python -m studio_tests.check.deletions`` prints the figure. Adjacent parentheses are equivalent: any of
the lists that they close is right.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from cxbridge.clipstext.syntax import PARENTHESIS, blank
from cxbridge.run import RunOptions
from cxbridge_studio.agent.top_level import TopLevelList, find_open_lists, split_top_level_lists
from cxbridge_studio.agent.unclosed import find_unclosed_lists
from cxbridge_studio.check.agent import Agent, find_agent_names
from tests.support import scenarios_of_installed_plugins

SCENARIOS = scenarios_of_installed_plugins()


@dataclass(frozen=True)
class Deletion:
    """A construct without one parenthesis.

    :param count: the number of adjacent parentheses.
    :param right: the starts of the lists that the adjacent parentheses close.
    """

    text: str
    count: int
    right: frozenset[int]


def make_deletions(part: TopLevelList) -> Iterator[Deletion]:
    """Yield the construct without each of its closing parentheses."""
    opened: list[int] = []
    runs: list[dict[int, int]] = []
    for match in PARENTHESIS.finditer(blank(part.text)):
        if match[0] == "(":
            opened.append(match.start())
        else:
            if not runs or max(runs[-1]) != match.start() - 1:
                runs.append({})
            runs[-1][match.start()] = opened.pop()
    for run in runs:
        first = min(run)
        text = part.text[:first] + part.text[first + 1 :]
        yield Deletion(text, len(run), frozenset(run.values()))


@dataclass
class Figure:
    """The number of deletions after which the check names a right list.

    :param innermost: the number of deletions after which the innermost open list is right.
    """

    total: int = 0
    right: int = 0
    innermost: int = 0

    def add(self, deletion: Deletion, slots: Mapping[str, set[str]]) -> None:
        """Count a deletion."""
        named = find_unclosed_lists(deletion.text, slots)[:1]
        self.total += deletion.count
        self.right += (not deletion.right.isdisjoint(named)) * deletion.count
        self.innermost += (find_open_lists(deletion.text)[-1] in deletion.right) * deletion.count


def compute_figure(scenarios: list[Path]) -> Figure:
    """Return the figure of scenarios."""
    result = Figure()
    for scenario in scenarios:
        slots: dict[str, set[str]] = {}
        for name in find_agent_names(RunOptions(scenario=scenario)):
            with Agent(RunOptions(scenario=scenario, agent=name)) as agent:
                slots |= agent.slots
        for path in sorted(scenario.glob("*.clp")):
            for part in split_top_level_lists(path.read_text()):
                for deletion in make_deletions(part):
                    result.add(deletion, slots)
    return result


if __name__ == "__main__":
    result = compute_figure(SCENARIOS)
    sys.stdout.write(f"{result.total} deletions, the right list named: {result.right / result.total:.1%}\n")
    sys.stdout.write(f"the innermost open list would be: {result.innermost / result.total:.1%}\n")
