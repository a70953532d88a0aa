"""Pairs plan-actions with the skills that executed them.

The executive records the message by which it sent a plan-action. Logs of Fawkes without facts, and recordings
of older versions of cxbridge, lack the message; only then are the pairs guessed.

An action changes from WAITING to RUNNING when the executive sees the skill run, and ends when it sees the
skill end. Candidates are therefore the actions that waited at the start of a skill and were RUNNING before
its end. Recorded facts give the Skiller and arguments of an action. Then only actions for the
Skiller remain, preferably those with most arguments in the skill string. Of several candidates, those that
ended together with the skill are preferred, then those with the name of the skill, then the action that
waited longest.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

from cxbridge.history.builder import RunHistory
from cxbridge.history.model import Moment, PlanActionRecord, SkillExecution
from cxbridge.history.transitions import NOT_SENT

# the character after the name in NAME{...}, NAME(...) and NAME ARGUMENTS
_SKILL_NAME_END = re.compile(r"[\s({]")

WAITING_STATES = frozenset({"PENDING", "WAITING"})
"""The states in which a plan-action waits for its skill to run."""

_RUNNING_STATE = "RUNNING"

MAX_END_GAP_US = 100_000
"""The interval in microseconds within which the ends of an action and a skill count as simultaneous.

The executive sees the end of a skill only when it reads the Skiller.
"""


@dataclass(frozen=True, slots=True)
class SkillLink:
    """A plan-action and its skill.

    :param ordered_at: the change after which the action waited for the skill.
    :param is_guessed: whether the pair was guessed.
    """

    action: PlanActionRecord
    call: SkillExecution
    ordered_at: Moment
    is_guessed: bool = False

    @property
    def guess_prefix(self) -> str:
        """The text to put before the skill: ``probably`` and a blank for a guessed pair, otherwise empty."""
        return "probably " if self.is_guessed else ""


@dataclass(frozen=True, slots=True)
class _Wait:
    """The waiting and running of an action.

    :param ordered_at: the change to the last state before RUNNING.
    :param running_seq: the seq of RUNNING.
    :param end_us: the time of the end of RUNNING; None if the end was not recorded.
    """

    action: PlanActionRecord
    ordered_at: Moment
    running_seq: int
    end_us: int | None


def find_skill_links(history: RunHistory) -> list[SkillLink]:
    """Return the pairs of actions and skills in the order in which the skills began."""
    # whether messages are recorded is decided per agent
    envs_with_messages = {action.env for action in history.actions if action.sent_calls}
    return sorted(
        [*_find_recorded_links(history), *_guess_links(history, envs_with_messages)],
        key=lambda link: link.call.begin,
    )


def _find_recorded_links(history: RunHistory) -> Iterator[SkillLink]:
    """Yield the recorded pairs."""
    # message ids are reused: the last call before the transition counts, unless the action was not yet sent
    # then
    calls_by_key: dict[tuple[str, str], list[SkillExecution]] = {}
    for call in history.calls:
        calls_by_key.setdefault(call.call_key, []).append(call)
    for action in history.actions:
        for seq, skiller, call_id in action.sent_calls:
            candidates = [
                call
                for call in calls_by_key.get((skiller, call_id), ())
                if call.begin.seq < seq and call.env in ("", action.env)
            ]
            unsent_seqs = [
                change.seq for change in action.changes if change.seq < seq and change.state in NOT_SENT
            ]
            if candidates and candidates[-1].begin.seq >= max(unsent_seqs, default=0):
                begin_seq = candidates[-1].begin.seq
                earlier_changes = [change for change in action.changes if change.seq < begin_seq]
                ordered_at = earlier_changes[-1] if earlier_changes else action.changes[0]
                yield SkillLink(action, candidates[-1], ordered_at.moment)


def _guess_links(history: RunHistory, envs_with_messages: Collection[str]) -> Iterator[SkillLink]:
    """Yield the most likely pairs.

    :param envs_with_messages: the environments whose messages are recorded.
    """
    waits = [wait for wait in _find_waits(history) if wait.action.env not in envs_with_messages]
    waits.sort(key=lambda wait: wait.running_seq)
    running_seqs = [wait.running_seq for wait in waits]
    skillers = {call.skiller for call in history.calls}
    paired_waits: set[tuple[int, int]] = set()  # the numbers of actions and of their changes to RUNNING
    for call in history.calls if waits else ():
        limit_seq = call.end.seq if call.end is not None else history.event_count
        candidates = [
            wait
            for wait in waits[
                bisect_right(running_seqs, call.begin.seq) : bisect_right(running_seqs, limit_seq)
            ]
            if wait.ordered_at.seq < call.begin.seq
            and call.env in ("", wait.action.env)
            # a name that is not a Skiller's proves nothing: it may be a robot's, if one Skiller serves all
            # robots
            and (
                wait.action.assignment.skiller == call.skiller
                or wait.action.assignment.skiller not in skillers
            )
            and (wait.action.number, wait.running_seq) not in paired_waits
        ]
        if candidates:
            wait = min(candidates, key=partial(_rank_candidate, call, history.end))
            paired_waits.add((wait.action.number, wait.running_seq))
            yield SkillLink(wait.action, call, wait.ordered_at, is_guessed=True)


def _find_waits(history: RunHistory) -> Iterator[_Wait]:
    """Yield the waiting of actions for skills."""
    for action in history.actions:
        changes = action.changes
        for index, (waiting_change, change) in enumerate(pairwise(changes)):
            if change.state == _RUNNING_STATE and waiting_change.state in WAITING_STATES:
                # the pair has the changes `index` and `index + 1`, so the next change ends RUNNING
                has_ended = index + 2 < len(changes)
                end_us = changes[index + 2].time if has_ended else None
                yield _Wait(action, waiting_change.moment, change.seq, end_us)


def _rank_candidate(call: SkillExecution, run_end_us: int, wait: _Wait) -> tuple[int, int, bool, int]:
    """Return the rank of a candidate; the lowest is the most likely."""
    end_us = call.end.time if call.end is not None else run_end_us
    gap_us = abs((run_end_us if wait.end_us is None else wait.end_us) - end_us)
    argument_count = wait.action.assignment.count_arguments_in(call.skill_string)
    # tuples compare in this order, and False precedes True
    return (
        -argument_count,
        gap_us // MAX_END_GAP_US,
        wait.action.name != _skill_name(call.skill_string),
        wait.ordered_at.seq,
    )


def _skill_name(skill_string: str) -> str:
    """Return the name of the skill that a skill string calls, or that an executor executes."""
    return _SKILL_NAME_END.split(skill_string, maxsplit=1)[0]
