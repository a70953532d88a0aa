"""Detection of rules that fire endlessly.

A run with an end uses up the present facts: its rules fire for facts, and combinations of facts, that no rule
has used yet. Endless rules fire for facts that they have just made, and for the same few other facts
repeatedly. A rule that loads 300,000 objects uses a different object each time; a ring of rules, of which
each activates the next and the last activates the first, does not.

The detection traces firings in windows of some thousand firings. A run counts as endless if for a long enough
time (:data:`ENDLESS_LIMITS`) all firings used only facts made in that time or used before. This is a
heuristic: a rule that counts to a million looks endless, too.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from clips._clips import lib

from cxbridge.events import Logger
from cxbridge.executive.host.capi import TRACE_OWNER, CData, ClipsApi, decode, make_callback

ENDLESS_LIMITS: Final = ((100_000, 1.0), (1_000, 5.0))
"""Pairs of firings and seconds of real time: fast rules, and rules whose firings are slow. A run that exceeds
both numbers of a pair is endless."""

MAX_FIRINGS: Final = 1_000_000
"""The maximum number of firings in a run, whatever their facts."""

_TRACE_AFTER_S: Final = 0.25  # the minimum duration of a phase without tracing
# the number of firings between checks: many fast firings, or few slow firings
_FAST_CHUNK_SIZE, _SLOW_CHUNK_SIZE = 200, 10
_SLOW_S: Final = 0.1  # the duration of a slow chunk
# the number of firings in a window, in which a ring of rules is searched
_MIN_WINDOW_SIZE, _WINDOW_SIZE = 20, 4_000
_MAX_WINDOW_DURATION_S: Final = 0.2  # a window of few, slow firings is evaluated after this time
_MAX_NAMES: Final = 8  # the maximum number of rules in a message


class EndlessRules:
    """Watches the runs of the agenda in chunks of firings.

    Tracing is expensive: it starts after a quarter of a second, and continues only while no firing uses an
    older fact. A part of the run with or without tracing is a phase.

    :param activation_basis: returns the facts of an activation: ``f-1,*,f-2``.
    :param rule_location: returns file and line of a rule; None if unknown.
    """

    def __init__(
        self,
        api: ClipsApi,
        activation_basis: Callable[[CData], str],
        rule_location: Callable[[str], tuple[Path, int] | None],
        log: Logger,
    ) -> None:
        self._api, self._log = api, log
        self._activation_basis, self._rule_location = activation_basis, rule_location
        self._hooks = (
            make_callback("void(Environment *, Activation *, void *)", self._record_firing),
            make_callback("void(Environment *, Fact *, void *)", self._record_fact),
        )
        self._is_tracing = False
        self.begin()

    @property
    def ring_text(self) -> str:
        """A description of the rules that seem endless in this run; empty if none do."""
        return self._describe_ring() if self._uses_no_older_facts else ""

    def begin(self) -> None:
        """Start watching a run."""
        self.end()
        self.firing_count = 0
        """The number of firings in this run up to the last check."""
        self.ring: tuple[str, ...] = ()
        """The rules that the second half of the last window repeated, as :func:`find_ring` returns them."""
        self.chunk_size = _SLOW_CHUNK_SIZE
        """The number of firings until the next check."""
        self._began_s = self._checked_s = self._phase_began_s = time.monotonic()
        self._count_before_trace = 0
        # whether no firing of the last window used an older fact for the first time
        self._uses_no_older_facts = False

    def end(self) -> None:
        """Stop tracing, at the end of a run or of a phase with tracing."""
        if self._is_tracing:
            self._is_tracing = False
            self._set_trace_hooks(None, None)
        self._begin_window(0.0)

    def _set_trace_hooks(self, firing_hook: CData | None, fact_hook: CData | None) -> None:
        self._api.set_hook("BeforeRuleFires", firing_hook, TRACE_OWNER)
        self._api.set_hook("Assert", fact_hook, TRACE_OWNER)

    def check(self, new_firings: int, *, has_limit: bool = False) -> str:
        """Count firings, and start or evaluate the tracing; return, and log, why the run is endless.

        :param new_firings: the number of firings since the last check.
        :param has_limit: whether the run ends after a number of firings, so that it cannot be endless.
        :returns: the reason; empty if the run is not endless.
        """
        now_s = time.monotonic()
        duration_s, self._checked_s = now_s - self._checked_s, now_s
        self.firing_count += new_firings
        self.chunk_size = _FAST_CHUNK_SIZE if duration_s < _SLOW_S else _SLOW_CHUNK_SIZE
        if self._is_tracing:
            self._evaluate_window(now_s)
        elif now_s - self._phase_began_s >= _TRACE_AFTER_S:
            self._start_tracing(now_s)
        if (self._is_endless(now_s) or self.firing_count >= MAX_FIRINGS) and not has_limit:
            duration_s = now_s - self._began_s
            self._log.error(
                f"{self._describe_ring()}, ended after {self.firing_count:,} firings in {duration_s:.1f} s"
            )
            return self._describe_ring()
        return ""

    def _is_endless(self, now_s: float) -> bool:
        if not self._uses_no_older_facts:
            return False
        traced_firings, traced_s = self.firing_count - self._count_before_trace, now_s - self._phase_began_s
        return any(
            traced_firings >= min_firings and traced_s >= min_s for min_firings, min_s in ENDLESS_LIMITS
        )

    def _describe_ring(self) -> str:
        """Return a message with the rules of the ring, their files and lines."""
        names = []
        for rule in self.ring[:_MAX_NAMES]:
            location = self._rule_location(rule)
            names.append(rule if location is None else f"{rule} ({location[0]}:{location[1]})")
        if len(self.ring) > _MAX_NAMES:
            names.append(f"{len(self.ring) - _MAX_NAMES} more")
        return f"rules fire endlessly: {' -> '.join([*names, *self.ring[:1]])}"

    def _start_tracing(self, now_s: float) -> None:
        self._is_tracing = True
        self._phase_began_s, self._count_before_trace = now_s, self.firing_count
        self._begin_window(now_s)
        self._set_trace_hooks(*self._hooks)

    def _begin_window(self, now_s: float) -> None:
        self._window_began_s = now_s
        self._firings: list[tuple[str, str]] = []
        self._first_new_index: int | None = None

    def _record_firing(self, _env: CData, activation: CData, _context: CData) -> None:
        self._firings.append((decode(lib.ActivationRuleName(activation)), self._activation_basis(activation)))

    def _record_fact(self, _env: CData, fact: CData, _context: CData) -> None:
        if self._first_new_index is None:
            self._first_new_index = int(lib.FactIndex(fact))

    def _evaluate_window(self, now_s: float) -> None:
        count = len(self._firings)
        if count < _WINDOW_SIZE and (
            count < _MIN_WINDOW_SIZE or now_s - self._window_began_s < _MAX_WINDOW_DURATION_S
        ):
            return
        # only the second half: other rules may have fired before the ring began
        self.ring = find_ring([rule for rule, _ in self._firings[count // 2 :]])
        self._uses_no_older_facts = not _consumes_older_facts(self._firings, self._first_new_index)
        if self._uses_no_older_facts:
            self._begin_window(now_s)
        else:
            self.end()
            self._phase_began_s = now_s  # the next phase has no tracing


def _consumes_older_facts(firings: Sequence[tuple[str, str]], first_new_index: int | None) -> bool:
    """Return whether rules in the second half of a window use older facts for the first time.

    :param firings: rule and facts of each firing: ``f-1,*,f-2``.
    :param first_new_index: the first index of facts made in the window; None without any.
    """
    # only the second half counts: a ring, too, uses older facts at the beginning of its first window
    middle, uses = len(firings) // 2, set()
    for number, (rule, basis) in enumerate(firings):
        facts = (fact for fact in basis.split(",") if fact.startswith("f-"))  # * is a negated pattern
        older_facts = tuple(
            fact for fact in facts if first_new_index is None or int(fact[2:]) < first_new_index
        )
        if older_facts and (rule, older_facts) not in uses:
            if number >= middle:
                return True
            uses.add((rule, older_facts))
    return False


def find_ring(rules: Sequence[str]) -> tuple[str, ...]:
    """Return the shortest sequence of rules that the firings repeat up to their end.

    The sequence is rotated so that the alphabetically first rule is the first: the same ring then always
    gives the same message. Without a repetition, return all rules, sorted.
    """
    for period in range(1, len(rules) // 2 + 1):
        if rules[period:] == rules[:-period]:
            ring = tuple(rules[-period:])
            start = ring.index(min(ring))
            return ring[start:] + ring[:start]
    return tuple(sorted(set(rules)))
