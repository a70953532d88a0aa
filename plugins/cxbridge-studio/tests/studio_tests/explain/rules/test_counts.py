"""The counts equal those of the CLIPS command `matches` on random rules and facts."""

from __future__ import annotations

import re

from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge_studio.explain.rules.diagnoser import diagnose
from cxbridge_studio.explain.rules.environment import take_snapshot
from studio_tests.explain.worlds import make_world
from tests.support import many

VALUES = st.sampled_from(["a", "b", "1", "2", '"a"'])
VARIABLES = st.sampled_from(["?x", "?y", "?z"])
TERMS = st.one_of(VALUES, VALUES.map("~{}".format), st.tuples(VALUES, VALUES).map("|".join), VARIABLES)


@st.composite
def patterns(draw):
    slots = draw(st.lists(st.sampled_from(["s", "t", "u"]), unique=True, max_size=3))
    return f"(p {' '.join(f'({slot} {draw(TERMS)})' for slot in slots)})"


FACTS = st.lists(
    st.tuples(VALUES, VALUES, VALUES).map(lambda v: f"(p (s {v[0]}) (t {v[1]}) (u {v[2]}))"),
    unique=True,
    max_size=8,
)
CES = st.lists(st.tuples(st.booleans(), patterns()), min_size=1, max_size=4)


@settings(max_examples=many(150, 37), deadline=None)
@given(FACTS, CES)
def test_joins_equal_counts_of_matches(facts, ces):
    texts = [
        f"(not {pattern})" if negated and place else pattern for place, (negated, pattern) in enumerate(ces)
    ]
    rule = f"(defrule it {' '.join(texts)} =>)"
    with make_world("(deftemplate p (slot s) (slot t) (slot u))", *facts, rule) as env:
        snapshot = take_snapshot(env, "it")
        diagnosis = diagnose(snapshot)
        joined = [element.joined.number if element.joined else 0 for element in diagnosis.elements]
        expected = {}
        for line in snapshot.clips_counts:
            match = re.match(r"(?:Pattern (1)|CEs 1 - (\d+)): (\d+)", line)
            if match:
                expected[int(match[1] or match[2])] = int(match[3])
        assert joined == [expected[place] for place in range(1, len(texts) + 1)]
        total = diagnosis.matches.number if diagnosis.matches else 0
        assert total == snapshot.activation_count


CONSTANTS = st.one_of(VALUES, VALUES.map("~{}".format), st.tuples(VALUES, VALUES).map("|".join))


@settings(max_examples=many(100, 25), deadline=None)
@given(FACTS, st.lists(st.tuples(CONSTANTS, CONSTANTS), min_size=1, max_size=3))
def test_patterns_alone_equal_counts_of_matches(facts, constraints):
    texts = [f"(p (s ?own{place}) (t {t}) (u {u}))" for place, (t, u) in enumerate(constraints)]
    rule = f"(defrule it {' '.join(texts)} =>)"
    with make_world("(deftemplate p (slot s) (slot t) (slot u))", *facts, rule) as env:
        snapshot = take_snapshot(env, "it")
        alone = [element.alone.number if element.alone else -1 for element in diagnose(snapshot).elements]
        expected = [int(line.split(": ")[1]) for line in snapshot.clips_counts if line.startswith("Pattern")]
        assert alone == expected


@settings(max_examples=many(100, 25), deadline=None)
@given(FACTS.filter(bool), st.tuples(CONSTANTS, CONSTANTS, CONSTANTS))
def test_nearest_facts_have_fewest_deviations(facts, constraints):
    """A slot agrees if a rule with this slot only matches the fact in the original environment."""
    pattern = "".join(f" ({slot} {text})" for slot, text in zip("stu", constraints, strict=True))
    probes = [
        f"(defrule only-{slot} (p ({slot} {text})) =>)" for slot, text in zip("stu", constraints, strict=True)
    ]
    with make_world(
        "(deftemplate p (slot s) (slot t) (slot u))", *facts, f"(defrule it (p{pattern}) =>)", *probes
    ) as env:
        snapshot = take_snapshot(env, "it")
        diagnosis = diagnose(snapshot)
        right: dict[str, int] = {}
        for activation in snapshot.agenda or ():
            if activation.rule.startswith("only-"):
                right[activation.basis] = right.get(activation.basis, 0) + 1
    if diagnosis.failure is not None:
        best = max(right.values(), default=0)
        for miss in diagnosis.failure.near:
            index = miss.fact.split()[0]
            assert right.get(index, 0) == best
            assert len(miss.deviations) == 3 - best
