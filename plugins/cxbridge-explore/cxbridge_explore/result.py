"""The result of an exploration, as text and as JSON values."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from cxbridge_explore.counterexample import Counterexample
from cxbridge_explore.graph import Edge, Graph
from cxbridge_explore.properties.builtin.table import RUN_ENDS
from cxbridge_explore.properties.monitor import Property

# exit statuses of `cxbridge explore`; 2, bad input, is the status of each CxbridgeError
_EXIT_CLEAN, _EXIT_VIOLATED, _EXIT_INCOMPLETE = 0, 1, 3


@dataclass(frozen=True, slots=True)
class ExploreResult:
    """The result of an exploration, which may be interrupted or still running.

    :param properties: the properties that each run was checked for.
    :param cpu_seconds: the processor time of all processes.
    :param wall_seconds: the real time.
    :param counterexamples: the counterexamples by property.
    """

    graph: Graph
    properties: tuple[Property, ...]
    cpu_seconds: float
    wall_seconds: float
    counterexamples: Mapping[str, Counterexample] = field(default_factory=dict)

    @property
    def is_complete(self) -> bool:
        """Whether no edge is open."""
        return not self.graph.open_edges

    @property
    def outcomes(self) -> dict[str, int]:
        """The number of runs by outcome; a cycle adds the outcome ``endless``."""
        counts = Counter(leaf.outcome for leaf in self.graph.leaves.values())
        if self.graph.find_cycle_node() is not None:
            counts["endless"] = 1
        return dict(sorted(counts.items()))

    @property
    def violations(self) -> list[dict[str, Any]]:
        """The violated properties, each with its counterexample, or with the choices of a run.

        That run has the fewest choices, unless it was given up or is in a cycle.
        """
        graph = self.graph
        violations: dict[str, dict[str, Any]] = {}
        for edge, leaf in graph.leaves.items():
            for violation in leaf.violations:
                row = self._add_choices(violation.as_dict(), edge)
                shortest_violation = violations.get(violation.property)
                if shortest_violation is None or len(row["choices"]) < len(shortest_violation["choices"]):
                    violations[violation.property] = row
        for edge, leaf in graph.leaves.items():
            if leaf.is_given_up and any(property_.name == RUN_ENDS for property_ in self.properties):
                row = {"property": RUN_ENDS, "message": leaf.reason, "seconds": leaf.seconds}
                # No counterexample is written, since a run on the same path would not end either.
                violations.setdefault(RUN_ENDS, self._add_choices(row, edge) | {"is_given_up": True})
        if (number := graph.find_cycle_node()) is not None:
            node, message = graph.nodes[number], "the run reaches the same state again and again"
            row = {"property": RUN_ENDS, "message": message, "seconds": node.point.seconds}
            violations.setdefault(RUN_ENDS, self._add_choices(row, node.edge))
        for name, counterexample in self.counterexamples.items():
            violations[name] = violations[name] | counterexample.as_dict()
        return [violations[name] for name in sorted(violations)]

    def _add_choices(self, violation: dict[str, Any], edge: Edge) -> dict[str, Any]:
        """Return a violation with the choices of its run; ``recording`` and ``test`` are None."""
        return violation | {
            "choices": [choice.as_dict() for choice in self.graph.trace_choices(edge)],
            "recording": None,
            "test": None,
        }

    @property
    def vacuous_names(self) -> list[str]:
        """The names of the properties that no run could have violated."""
        evaluated_names = {name for leaf in self.graph.leaves.values() for name in leaf.evaluated_names}
        return [property_.name for property_ in self.properties if property_.name not in evaluated_names]

    @property
    def status(self) -> int:
        """The exit status of the command."""
        if self.violations:
            return _EXIT_VIOLATED
        return _EXIT_CLEAN if self.is_complete else _EXIT_INCOMPLETE

    def as_dict(self) -> dict[str, Any]:
        graph = self.graph
        return {
            "complete": self.is_complete,
            "runs": len(graph.leaves),
            "states": len(graph.nodes),
            "merged": graph.merged_count,
            "outcomes": self.outcomes,
            "violations": self.violations,
            "vacuous": self.vacuous_names,
            "not_merged": list(graph.unmerged_reasons),
            "cpu_seconds": round(self.cpu_seconds, 3),
            "wall_seconds": round(self.wall_seconds, 3),
        }

    def lines(self) -> Iterator[str]:
        """Yield the result as lines of text."""
        graph = self.graph
        end_text = "complete" if self.is_complete else f"not complete, {graph.open_branches_text}"
        yield f"{graph.counts_text}: {end_text}"
        for outcome, count in self.outcomes.items():
            yield f"  {outcome}: {count}"
        for violation in self.violations:
            # "words" is the sentence of the counterexample, which endless runs and running explorations lack
            message = violation.get("words") or violation["message"]
            yield f"violated: {violation['property']}: {message}"
            for choice in violation["choices"]:
                yield f"  {choice['seconds']:8.2f} s {choice['subject']}: {choice['option']}"
            for name in ("recording", "test"):
                if violation[name] is not None:
                    yield f"  {name}: {violation[name]}"
        for text in graph.unmerged_reasons:
            yield f"equal states were not merged: {text}"
        if self.vacuous_names:
            yield f"no run could have violated: {', '.join(self.vacuous_names)}"
        yield f"{self.wall_seconds:.2f} s, {self.cpu_seconds:.2f} s of processor time"
