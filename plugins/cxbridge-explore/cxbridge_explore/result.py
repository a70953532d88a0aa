"""The result of an exploration, as text and as JSON values."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from cxbridge_explore.counterexample import Counterexample
from cxbridge_explore.graph import Edge, Graph, Leaf
from cxbridge_explore.properties.builtin.table import RUN_ENDS
from cxbridge_explore.properties.monitor import Property

CLEAN, VIOLATED, BAD_INPUT, INCOMPLETE = range(4)  # exit statuses of `cxbridge explore`


@dataclass(frozen=True, slots=True)
class ExploreResult:
    """The result of an exploration.

    :param properties: the properties of every run.
    :param hidden: the reasons why states were not compared.
    :param cpu_seconds: the processor time of all processes.
    :param wall_seconds: the real time.
    :param counterexamples: by property.
    """

    graph: Graph
    properties: tuple[Property, ...]
    hidden: tuple[str, ...]
    cpu_seconds: float
    wall_seconds: float
    counterexamples: Mapping[str, Counterexample] = field(default_factory=dict)

    @property
    def is_complete(self) -> bool:
        """Whether no edge is open."""
        return not self.graph.open

    @property
    def outcomes(self) -> dict[str, int]:
        """The number of runs by outcome."""
        counts = Counter(leaf.outcome for leaf in self.graph.leaves.values())
        counts.update({"endless": len(self.graph.cycles())})
        return dict(sorted((+counts).items()))

    @property
    def violations(self) -> list[dict[str, Any]]:
        """The violated properties, each with its counterexample, or with its shortest path."""
        first_violations: dict[str, dict[str, Any]] = {}
        for edge, leaf in self.graph.leaves.items():
            for each in leaf.violations:
                choices = self.graph.choices_to(edge)
                known = first_violations.get(each.property)
                if known is None or len(choices) < len(known["choices"]):
                    first_violations[each.property] = {
                        **each.as_dict(),
                        "choices": choices,
                        "recording": None,
                        "test": None,
                    }
        for edge, leaf in self.graph.leaves.items():
            if leaf.is_given_up and any(each.name == RUN_ENDS for each in self.properties):
                first_violations.setdefault(RUN_ENDS, self._given_up(edge, leaf))
        for number in self.graph.cycles():
            first_violations.setdefault(
                RUN_ENDS,
                {
                    "property": RUN_ENDS,
                    "message": "the run comes to the same state again and again",
                    "seconds": self.graph.nodes[number].point.seconds,
                    "choices": self.graph.choices_to(self.graph.nodes[number].edge),
                    "recording": None,
                    "test": None,
                },
            )
        first_violations |= {
            name: {**first_violations[name], **each.as_dict()} for name, each in self.counterexamples.items()
        }
        return [first_violations[name] for name in sorted(first_violations)]

    def _given_up(self, edge: Edge, leaf: Leaf) -> dict[str, Any]:
        """Return the violation of a run that was given up.

        It has no counterexample, which would not end either.
        """
        return {
            "property": RUN_ENDS,
            "message": leaf.reason,
            "seconds": leaf.seconds,
            "choices": self.graph.choices_to(edge),
            "recording": None,
            "test": None,
            "is_given_up": True,
        }

    @property
    def vacuous(self) -> list[str]:
        """The properties that no run could have violated."""
        evaluated = {name for leaf in self.graph.leaves.values() for name in leaf.evaluated}
        return [each.name for each in self.properties if each.name not in evaluated]

    @property
    def status(self) -> int:
        if self.violations:
            return VIOLATED
        return CLEAN if self.is_complete else INCOMPLETE

    def as_dict(self) -> dict[str, Any]:
        graph = self.graph
        return {
            "complete": self.is_complete,
            "runs": len(graph.leaves),
            "states": len(graph.nodes),
            "merged": graph.merged,
            "outcomes": self.outcomes,
            "violations": self.violations,
            "vacuous": self.vacuous,
            "not_merged": list(self.hidden),
            "cpu_seconds": round(self.cpu_seconds, 3),
            "wall_seconds": round(self.wall_seconds, 3),
        }

    def lines(self) -> Iterator[str]:
        graph = self.graph
        rest = "complete" if self.is_complete else f"not complete, {len(graph.open)} branches are open"
        yield f"{len(graph.leaves)} runs, {len(graph.nodes)} states, {graph.merged} merged: {rest}"
        for outcome, count in self.outcomes.items():
            yield f"  {outcome}: {count}"
        for each in self.violations:
            yield f"violated: {each['property']}: {each.get('words') or each['message']}"
            for choice in each["choices"]:
                yield f"  {choice['seconds']:8.2f} s {choice['subject']}: {choice['option']}"
            for name in ("recording", "test"):
                if each[name] is not None:
                    yield f"  {name}: {each[name]}"
        for text in self.hidden:
            yield f"equal states were not merged: {text}"
        if self.vacuous:
            yield f"no run could have violated: {', '.join(self.vacuous)}"
        yield f"{self.wall_seconds:.2f} s, {self.cpu_seconds:.2f} s of processor time"
