"""Detection of rules that fire endlessly.

A run with an end uses up the present facts: its rules fire for facts, and combinations of facts, that no rule
has used yet. Endless rules fire for facts that they have just made, and for the same few other facts
repeatedly. A rule that loads 300,000 objects uses a different object each time; a ring of rules does not.

This is a heuristic, because a rule that counts to a million looks endless. A run counts as endless if for a
long enough time all firings used only facts made in that time or used before (:data:`ENDLESS`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from clips._clips import lib

from cxbridge.events import Logger
from cxbridge.executive.host.capi import CData, ClipsApi, callback, decode

ENDLESS: Final = ((100_000, 1.0), (1_000, 5.0))
"""Firings and seconds of real time. A run that exceeds both numbers of a pair is endless."""

WARN_AFTER_S: Final = 1.5
"""Seconds of real time before the first warning about possibly endless rules."""

MAX_FIRINGS: Final = 1_000_000
"""The maximum number of firings in a run, whatever their facts."""

_TRACE_AFTER_S: Final = 0.25  # seconds of a run before tracing starts
# firings between checks: doubled after a fast chunk, halved after a slow one
_MIN_CHUNK, _MAX_CHUNK = 20, 200
_FAST_S, _SLOW_S = 0.02, 0.1
# firings in which a ring of rules is searched: doubled while firings use older facts
_MIN_WINDOW, _FIRST_WINDOW, _MAX_WINDOW = 20, 4_000, 64_000
_WINDOW_S: Final = 0.2  # seconds after which a window of few, slow firings is evaluated
_MAX_NAMES: Final = 8  # rules in a message


class EndlessRules:
    """Watches the runs of the agenda in chunks of firings.

    :param basis_of: returns the facts of an activation: ``f-1,*,f-2``.
    :param place_of: returns file and line of a rule; None if unknown.
    """

    # tracing is expensive: it starts after a quarter of a second of a run, and continues only while no firing
    # uses an older fact
    def __init__(
        self,
        api: ClipsApi,
        basis_of: Callable[[CData], str],
        place_of: Callable[[str], tuple[Path, int] | None],
        log: Logger,
    ) -> None:
        self._api, self._basis_of, self._place_of, self._log = api, basis_of, place_of, log
        self._hooks = (
            callback("void(Environment *, Activation *, void *)", self._record_firing),
            callback("void(Environment *, Fact *, void *)", self._record_fact),
        )
        self._is_tracing = False
        self.begin()

    @property
    def text(self) -> str:
        """A description of the endless rules in this run; empty without any."""
        return self._describe_ring() if self._is_closed else ""

    def begin(self) -> None:
        """Start watching a run."""
        self.end()
        self.fired = 0
        """The firings in this run up to the last check."""
        self.ring: tuple[str, ...] = ()
        """The rules of the last window in firing order; a ring if they are endless."""
        self.chunk = _MIN_CHUNK
        """The number of firings until the next check."""
        self._began_s = self._checked_s = self._since_s = time.monotonic()
        self._since_fired = 0
        self._is_closed = (
            False  # whether the firings of the last window used no older fact for the first time
        )
        self._has_warned = False
        self._window = _FIRST_WINDOW

    def end(self) -> None:
        """Stop tracing at the end of a run."""
        if self._is_tracing:
            self._is_tracing = False
            self._api.trace(None, None)
        self._clear(0.0)

    def check(self, fired: int) -> str:
        """Return why the run is endless; empty if it is not.

        :param fired: the number of firings since the last check.
        """
        now_s = time.monotonic()
        took_s, self._checked_s = now_s - self._checked_s, now_s
        self.fired += fired
        if took_s < _FAST_S:
            self.chunk = min(2 * self.chunk, _MAX_CHUNK)
        elif took_s > _SLOW_S:
            self.chunk = max(self.chunk // 2, 1)
        if self._is_tracing:
            self._evaluate_window(now_s)
        elif now_s - self._since_s >= _TRACE_AFTER_S:
            self._start_tracing(now_s)
        if self.fired >= MAX_FIRINGS or self._is_endless(now_s):
            self._log.error(f"{self._describe_ring()}, ended after {self._figures(now_s)}")
            return self._describe_ring()
        return ""

    def _is_endless(self, now_s: float) -> bool:
        """Return whether the run is endless; warn of a run that may be."""
        if not self._is_closed:
            return False
        fired, seconds = self.fired - self._since_fired, now_s - self._since_s
        if any(fired >= max_fired and seconds >= max_s for max_fired, max_s in ENDLESS):
            return True
        if not self._has_warned and now_s - self._began_s >= WARN_AFTER_S:
            self._has_warned = True
            self._log.warn(f"{self._describe_ring()}, {self._figures(now_s)} so far")
        return False

    def _describe_ring(self) -> str:
        """Return the rules of the ring with file and line as text."""
        names = []
        for rule in self.ring[:_MAX_NAMES]:
            location = self._place_of(rule)
            names.append(rule if location is None else f"{rule} ({location[0]}:{location[1]})")
        if len(self.ring) > _MAX_NAMES:
            names.append(f"{len(self.ring) - _MAX_NAMES} more")
        return f"rules fire without an end: {' -> '.join([*names, *self.ring[:1]])}"

    def _figures(self, now_s: float) -> str:
        return f"{self.fired:,} firings in {now_s - self._began_s:.1f} s"

    def _start_tracing(self, now_s: float) -> None:
        self._is_tracing = True
        self._since_s, self._since_fired = now_s, self.fired
        self._clear(now_s)
        self._api.trace(*self._hooks)

    def _clear(self, now_s: float) -> None:
        self._window_s = now_s
        self._firings: list[tuple[str, str]] = []
        self._first_new_index: int | None = None

    def _record_firing(self, _env: CData, activation: CData, _context: CData) -> None:
        self._firings.append((decode(lib.ActivationRuleName(activation)), self._basis_of(activation)))

    def _record_fact(self, _env: CData, fact: CData, _context: CData) -> None:
        if self._first_new_index is None:
            self._first_new_index = int(lib.FactIndex(fact))

    def _evaluate_window(self, now_s: float) -> None:
        count = len(self._firings)
        if count < self._window and (count < _MIN_WINDOW or now_s - self._window_s < _WINDOW_S):
            return
        self.ring = ring_of([rule for rule, _ in self._firings[count // 2 :]])
        self._is_closed = not _consumes_older_facts(self._firings, self._first_new_index)
        if self._is_closed:
            self._clear(now_s)
        else:
            self.end()
            self._since_s, self._has_warned = now_s, False
            self._window = min(2 * self._window, _MAX_WINDOW)


def _consumes_older_facts(firings: Sequence[tuple[str, str]], first_new_index: int | None) -> bool:
    """Return whether rules in the second half of a window use older facts for the first time.

    :param firings: rule and facts of each firing: ``f-1,*,f-2``.
    :param first_new_index: the first index of facts made in the window; None without any.
    """
    # only the second half counts: a ring, too, uses older facts when the window begins
    half, used = len(firings) // 2, set()
    for number, (rule, basis) in enumerate(firings):
        facts = (fact for fact in basis.split(",") if fact.startswith("f-"))  # * is a negated pattern
        older = tuple(fact for fact in facts if first_new_index is None or int(fact[2:]) < first_new_index)
        if older and (rule, older) not in used:
            if number >= half:
                return True
            used.add((rule, older))
    return False


def ring_of(rules: Sequence[str]) -> tuple[str, ...]:
    """Return the shortest sequence that the firings repeat up to their end, starting with the first name.

    Without a repetition, return each rule once.
    """
    # Knuth-Morris-Pratt's longest border of each prefix, on the reversed firings
    back, border, borders = rules[::-1], 0, [0]
    for rule in back[1:]:
        while border and rule != back[border]:
            border = borders[border - 1]
        border += rule == back[border]
        borders.append(border)
    period = len(rules) - borders[-1]
    if 2 * period > len(rules):
        return tuple(sorted(set(rules)))
    ring = tuple(rules[-period:])
    first = ring.index(min(ring))
    return ring[first:] + ring[:first]
