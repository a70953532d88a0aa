"""Comparison in total order: the runs must have equal events at equal positions.

Names, such as ids of goals, differ between runs. They are numbered by first appearance, so equal runs have
equal steps. Other runs are aligned twice: first without names, so that the paired steps show which name of B
stands for which name of A, then with these names.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from operator import attrgetter

from cxbridge.trace.compare.align import align, pop_equal_pairs
from cxbridge.trace.compare.model import Difference
from cxbridge.trace.compare.names import Names
from cxbridge.trace.compare.sequences import compare_sequences
from cxbridge.trace.compare.steps import Step


def compare_total(
    a: Sequence[Step], b: Sequence[Step], tolerance_s: float | None = None
) -> Iterator[Difference]:
    """Yield the differences between the steps of two runs, in order.

    :param tolerance_s: the allowed difference between times in seconds; None: times are not compared.
    """
    common_names: frozenset[int] = frozenset()
    if len(a) != len(b) or any(step.content != partner.content for step, partner in zip(a, b, strict=True)):
        partners = _pair_names(a, b)
        common_names = frozenset(partners.values())
        b = [_rename_step(step, partners) for step in b]
    return compare_sequences(a, b, tolerance_s=tolerance_s, common_names=common_names)


def _pair_names(steps_a: Sequence[Step], steps_b: Sequence[Step]) -> Mapping[int, int]:
    """Return the names of A by those of B, by the votes of steps that are equal except for names."""
    votes: Counter[tuple[int, int]] = Counter()
    unaligned_a: list[Step] = []
    unaligned_b: list[Step] = []
    end_a = end_b = 0
    # hashes of a million steps need less memory than their keys
    key_hashes = (array("q", (hash(step.key) for step in steps)) for steps in (steps_a, steps_b))
    for start_a, start_b, size in align(*key_hashes):
        unaligned_a += steps_a[end_a:start_a]
        unaligned_b += steps_b[end_b:start_b]
        end_a, end_b = start_a + size, start_b + size
        for pair in zip(steps_a[start_a:end_a], steps_b[start_b:end_b], strict=True):
            votes.update(_pair_step_names(*pair))
    for pair in pop_equal_pairs(unaligned_a, unaligned_b, attrgetter("key")):
        votes.update(_pair_step_names(*pair))
    # names are paired one to one: a pair with fewer votes is dropped if a name of it is paired already
    partners: dict[int, int] = {}
    paired_names: set[int] = set()
    for (name_a, name_b), _ in votes.most_common():
        if name_b not in partners and name_a not in paired_names:
            partners[name_b] = name_a
            paired_names.add(name_a)
    return partners


def _pair_step_names(a: Step, b: Step) -> Iterator[tuple[int, int]]:
    """Yield the names at equal places of two steps with equal keys, as pairs."""
    # a recorded text may contain `gen#` itself: the keys are then equal, but one step has fewer names
    yield from zip(a.names, b.names, strict=False)
    if a.details and b.details and a.details[0] == b.details[0]:
        yield from zip(a.details[1], b.details[1], strict=False)


def _rename_step(step: Step, partners: Mapping[int, int]) -> Step:
    """Return a step of B with the names of A."""

    def rename(names: Names) -> Names:
        # A name of B without a partner becomes a negative number, which no name of A has. The numbers start
        # at -2, because steps are aligned by hashes and Python's hashes of -1 and -2 are equal.
        return tuple(partners.get(name, -2 - name) for name in names)

    names = rename(step.names)
    if step.details is None and names == step.names:
        return step
    details = step.details and (step.details[0], rename(step.details[1]))
    return step._replace(names=names, details=details)
