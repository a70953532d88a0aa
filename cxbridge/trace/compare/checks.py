"""Checks of paired steps: message ids, times, and details such as parameters.

The message ids and times of any two runs differ, so the checks compare the offsets between both runs with the
offsets of earlier pairs.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterator
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.trace.compare.model import Difference, DifferenceKind, Side
from cxbridge.trace.compare.steps import NamedKey, Step, describe_changes

# The slot `id` of the fact of an interface, which names the interface among those of its type.
_FACT_ID: Final = re.compile(r'\(id "?([^")]*)')


class PairChecks:
    """Finds differences between paired steps, given in order.

    The message ids of a Skiller or interface count as equal if their offset is one of the two offsets that
    appeared last as new offsets.

    :param tolerance_s: the allowed difference between times in seconds; None: times are not compared.
    """

    def __init__(self, tolerance_s: float | None) -> None:
        self._tolerance_us = None if tolerance_s is None else round(tolerance_s * MICROSECONDS)
        self._last_times_us: dict[Hashable, tuple[int, int]] = {}  # of both runs, by thread
        self._offsets: dict[Hashable, tuple[int, int]] = {}  # the two newest by stream, in order
        # in both runs, by goal or plan-action
        self._details: tuple[dict[Hashable, NamedKey], dict[Hashable, NamedKey]] = ({}, {})
        # the differing details of both runs that were yielded last, by goal or plan-action
        self._reported_details: dict[Hashable, tuple[NamedKey | None, ...]] = {}
        self._has_unpaired_details = False

    def find_differences(self, a: Step, b: Step) -> Iterator[Difference]:
        """Yield the differences of the next pair."""
        sides = Side(a.position), Side(b.position)
        if (a.msgid or b.msgid) and self._has_new_offset(_message_stream(a), a.msgid or 0, b.msgid or 0):
            yield Difference("another message id", "", *sides, DifferenceKind.MSGID)
        if self._tolerance_us is not None:
            # the first event of a thread has no earlier time, so its lag is 0
            last_a_us, last_b_us = self._last_times_us.get(a.thread, (a.time_us, b.time_us))
            self._last_times_us[a.thread] = (a.time_us, b.time_us)
            lag_us = (b.time_us - last_b_us) - (a.time_us - last_a_us)
            if abs(lag_us) > self._tolerance_us:
                lag_text = f"{abs(lag_us) / MICROSECONDS:.6g} s {'later' if lag_us > 0 else 'earlier'}"
                yield Difference(f"another time: {lag_text} in B", "", *sides, DifferenceKind.TIME)
        if a.details or b.details or self._has_unpaired_details:
            self._note_details(0, a)
            self._note_details(1, b)
            details_a, details_b = pair = tuple(details.get(a.subject) for details in self._details)
            # a detail that differs in all events of a goal or plan-action is one difference
            if (
                details_a
                and details_b
                and details_a != details_b
                and self._reported_details.get(a.subject) != pair
            ):
                self._reported_details[a.subject] = pair
                yield Difference(describe_changes(details_a, details_b), "", *sides, has_details=True)

    def note_unpaired(self, run: int, step: Step) -> None:
        """Note a step that only one run has: 0 is A, 1 is B."""
        if step.msgid is not None:
            # such an event may shift the later message ids
            self._offsets.pop(_message_stream(step), None)
        self._note_details(run, step)
        self._has_unpaired_details |= step.details is not None

    def _has_new_offset(self, stream: Hashable, id_a: int, id_b: int) -> bool:
        """Return whether a pair's offset is new. The id 0 means no message and equals only 0."""
        if not id_a or not id_b:
            return True
        offset = id_b - id_a
        # after a single wrong id, the next pair may keep the new offset or return to the offset before
        offsets = self._offsets.setdefault(stream, (offset, offset))
        if offset in offsets:
            return False
        self._offsets[stream] = (offsets[1], offset)
        return True

    def _note_details(self, run: int, step: Step) -> None:
        if step.details is not None:
            self._details[run][step.subject] = step.details


def _message_stream(step: Step) -> Hashable:
    """Return the Skiller or interface whose messages share a sequence of ids."""
    parts, _names = step.thread
    if step.key[0] != "fact":
        return parts
    match = _FACT_ID.search(step.key[-1])
    return (*parts, match.group(1) if match else "")
