"""Why the condition of a rule matches nothing: element by element, by CLIPS' own matching."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import show
from cxbridge.explain.bench import Bench, Count
from cxbridge.explain.diagnosis import Diagnosis, Element, Failure
from cxbridge.explain.lhs import CE, Condition, Group, Pattern, Test, parse_rule
from cxbridge.explain.nearest import find_nearest
from cxbridge.explain.prefix import Prefix, fact_text, shown
from cxbridge.explain.snapshot import Snapshot

MOST_SHOWN: Final = 3
"""Facts, values and near misses that are listed of each kind."""

MOST_BASES: Final = 200
"""Complete matches that are listed."""


def diagnose(snapshot: Snapshot) -> Diagnosis:
    """Find out how the condition of the snapshot's rule stands."""
    if snapshot.too_many:
        return undiagnosed(
            snapshot, f"{snapshot.too_many - 1}+ facts of its templates are too many to look at"
        )
    try:
        with Bench(snapshot) as bench:
            return _Diagnoser(snapshot, parse_rule(snapshot.text), bench).diagnosis()
    except ClipsError as error:
        return undiagnosed(snapshot, error.message)


def undiagnosed(snapshot: Snapshot, reason: str) -> Diagnosis:
    """Return what there is to tell of a rule whose condition cannot be matched."""
    condition = parse_rule(snapshot.text)
    plain = tuple(Element(place, ce.text, None, None) for place, ce in enumerate(condition.ces, 1))
    return Diagnosis(condition.salience, plain, unknown=reason)


class _Diagnoser:
    def __init__(self, snapshot: Snapshot, condition: Condition, bench: Bench) -> None:
        self._snapshot = snapshot
        self._condition = condition
        self._bench = bench

    def diagnosis(self) -> Diagnosis:
        """Count, and explain the first CE with which nothing matches."""
        ces, bench = self._condition.ces, self._bench
        elements: list[Element] = []
        failing, unknown = 0, ""
        joined: Count | None = bench.count(())
        for number, ce in enumerate(ces, 1):
            if failing or unknown:
                joined = None
            else:
                try:
                    joined = bench.count([each.text for each in ces[:number]])
                    failing = number if joined.number == 0 else 0
                except ClipsError as error:
                    joined, unknown = None, f"CE {number} cannot be matched on a copy: {error.message}"
            elements.append(Element(number, ce.text, self._alone(ces[: number - 1], ce), joined))
        if unknown:
            return Diagnosis(self._salience(), tuple(elements), errors=tuple(bench.errors), unknown=unknown)
        failure = None
        if failing:
            failure = self._explain(list(ces[: failing - 1]), ces[failing - 1])
        whole = [ce.text for ce in ces]
        return Diagnosis(
            self._salience(),
            tuple(elements),
            failing,
            failure,
            None if failing else joined,
            () if failing else tuple(bench.bases(whole, MOST_BASES)),
            tuple(bench.errors),
        )

    def _salience(self) -> str:
        if not self._condition.salience:
            return ""
        try:
            return show(self._bench.value(self._condition.salience))
        except ClipsError:
            return self._condition.salience

    def _alone(self, before: Sequence[CE], ce: CE) -> Count | None:
        """Return how many facts match a pattern, the only one of its CE, by itself."""
        inner = ce.items[0] if isinstance(ce, Group) and len(ce.items) == 1 else ce
        if not isinstance(inner, Pattern):
            return None
        foreign = Prefix(list(before)).binds
        try:
            pattern = f"?cx-why-fact <- {inner.alone(foreign)}"
            # a multislot can match in several ways; the fact counts once
            found = self._bench.note([pattern], ["cx-why-fact"], limit=-1)
        except ClipsError:
            return None
        return Count(len(set(found)))

    def _explain(self, before: list[CE], ce: CE) -> Failure:
        """Tell why a CE matches nothing after those before it, which match."""
        try:
            if isinstance(ce, Pattern):
                return find_nearest(self._bench, self._snapshot, Prefix(before), ce)
            if isinstance(ce, Test):
                return self._explain_test(Prefix(before), ce)
            return getattr(self, f"_explain_{ce.kind}")(before, ce)  # type: ignore[no-any-return]
        except ClipsError as error:
            return Failure("unknown", ce.text, f"how near it comes cannot be found out: {error.message}")

    def _explain_test(self, prefix: Prefix, ce: Test) -> Failure:
        names = sorted(ce.used & prefix.binds)
        rows = self._bench.note(prefix.texts, names, MOST_SHOWN) if names else []
        values = dict.fromkeys(
            ", ".join(f"?{name} = {shown(value)}" for name, value in zip(names, row, strict=True))
            for row in rows
        )
        return Failure("test", ce.text, "it is false for every match so far", values=tuple(values))

    def _explain_not(self, before: list[CE], ce: Group) -> Failure:
        positive = Prefix([*before, *ce.items])
        own = positive.facts[len(Prefix(before).facts) :]
        rows = self._bench.note(positive.texts, own, 20 * MOST_SHOWN) if own else []
        wanted = [item for item in ce.items if isinstance(item, Pattern)]
        facts = dict.fromkeys(
            " with ".join(self._fact(ref.index, pattern) for ref, pattern in zip(row, wanted, strict=True))
            for row in rows
        )
        many = len(facts) > MOST_SHOWN
        reason = "it is not to match, but does" if facts else "what is in it always matches"
        listed = [*list(facts)[:MOST_SHOWN], *(["and more"] if many else [])]
        return Failure("not", ce.text, reason, facts=tuple(listed))

    def _explain_exists(self, before: list[CE], ce: Group) -> Failure:
        inner = self._sequence(before, list(ce.items))
        return Failure("exists", ce.text, inner.reason, inner.near, inner.facts, inner.values, inner.inner)

    def _explain_and(self, before: list[CE], ce: Group) -> Failure:
        return self._sequence(before, list(ce.items))

    def _explain_forall(self, before: list[CE], ce: Group) -> Failure:
        first, *rest = ce.items
        lacking = f"(not (and {' '.join(item.text for item in rest)}))"
        positive = Prefix([*before, first])
        own = positive.facts[-1:] if isinstance(first, Pattern) else []
        rows = self._bench.note([*positive.texts, lacking], own, MOST_SHOWN) if own else []
        facts = [self._fact(row[0].index, first) for row in rows if isinstance(first, Pattern)]
        reason = f"not every {first.text} has {' '.join(item.text for item in rest)}"
        return Failure("forall", ce.text, reason, facts=tuple(dict.fromkeys(facts)))

    def _explain_or(self, before: list[CE], ce: Group) -> Failure:
        branches = tuple(self._explain(before, branch) for branch in ce.items)
        return Failure("or", ce.text, "none of its branches matches", inner=branches)

    def _sequence(self, before: list[CE], ces: list[CE]) -> Failure:
        """Explain the first of several CEs with which nothing matches."""
        for place, ce in enumerate(ces):
            prefix = Prefix([*before, *ces[: place + 1]])
            if self._bench.count(prefix.texts).number == 0:
                return self._explain([*before, *ces[:place]], ce)
        raise ClipsError("its parts match one after the other")

    def _fact(self, index: int, pattern: Pattern) -> str:
        return fact_text(self._bench.rows[index], self._snapshot, {part.slot for part in pattern.parts})
