"""Copies of facts in pieces, during changes by rules."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.clipstext.values import FactRef
from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.facts.copying import PIECE_SIZE, FactCopier

COUNT = 3 * PIECE_SIZE + 7


@pytest.fixture(autouse=True)
def _template(env):
    env.build("(deftemplate box (slot id) (slot size (default 1.5)) (multislot notes))")


def copied(env, wanted=lambda _name: True):
    copier = FactCopier(env.c_env, wanted)
    for _ in copier.pieces():
        pass
    return copier.copy


def fill(env, count=COUNT):
    for number in range(count):
        env.assert_string(f'(box (id {number}) (notes a "b" {number}))')


def test_copy_equals_facts_of_environment(env):
    fill(env)
    env.assert_string("(ordered 1 2.5 x)")
    env.assert_string("(empty)")
    copy = copied(env)
    names = {name: template.names for name, template in copy.templates.items()}
    facts = [
        (row.index, row.template, dict(zip(names[row.template], row.values, strict=True)))
        for row in copy.rows
    ]
    assert facts == list(env.facts())
    assert [type(value) for row in copy.rows[1:2] for value in row.values] == [
        type(value) for _, _, slots in list(env.facts())[1:2] for value in slots.values()
    ]
    assert list(copy.facts_of("box")) == [slots for _, _, slots in env.facts("box")]
    assert copy.templates["empty"].slots is None
    assert copy.templates["box"].slots == (("id", False), ("size", False), ("notes", True))


def test_fact_in_slot_becomes_index(env):
    env.build("(deftemplate pointer (slot to) (multislot more))")
    index = env.assert_string("(box (id x))")
    env.eval("(do-for-fact ((?b box)) TRUE (assert (pointer (to ?b) (more ?b 1))))")
    (row,) = (row for row in copied(env).rows if row.template == "pointer")
    assert row.values == (FactRef(index), (FactRef(index), 1))


def test_copy_of_selected_deftemplates(env):
    fill(env, 3)
    env.assert_string("(other)")
    assert {row.template for row in copied(env, "box".__eq__).rows} == {"box"}
    assert copied(env, "nothing".__eq__).rows == []


def test_copy_holds_old_or_new_values_of_changes(env):
    fill(env)
    indices = [index for index, _, _ in env.facts()]
    copier = FactCopier(env.c_env, lambda _name: True)
    pieces = copier.pieces()
    next(pieces)
    gone_before, here, gone_after = indices[0], indices[PIECE_SIZE - 1], indices[-1]
    for index in (gone_before, here, gone_after):
        assert env.retract(index)
    env.eval("(do-for-fact ((?b box)) (eq ?b:id 150) (retract ?b))")
    new = env.assert_string("(box (id new))")
    for _ in pieces:
        env.assert_string("(noise)")
    rows = {row.index: row for row in copier.copy.rows}
    assert list(rows) == [index for index, _, _ in env.facts() if index in rows]
    assert not {gone_before, here, gone_after} & set(rows)
    assert rows[new].values[0] == "new"
    assert {slots["id"] for slots in copier.copy.facts_of("box")} == {
        slots["id"] for _, _, slots in env.facts("box")
    }


@settings(max_examples=12, deadline=None)
@given(
    st.lists(
        st.tuples(st.integers(0, 3), st.sampled_from(["retract", "assert", "modify"]), st.integers(0, 10**6)),
        max_size=30,
    )
)
def test_copy_holds_all_facts_that_remain(changes):
    env = ClipsEnvironment("test", EventBus(RealClock()))
    try:
        env.build("(deftemplate box (slot id) (slot size) (multislot notes))")
        fill(env, 33)
        copier = FactCopier(env.c_env, "box".__eq__, piece_size=10)
        for piece, _ in enumerate(copier.pieces()):
            for at, operation, number in changes:
                indices = [index for index, _, _ in env.facts("box")]
                if at != piece or not indices:
                    continue
                index = indices[number % len(indices)]
                if operation == "retract":
                    env.retract(index)
                elif operation == "assert":
                    env.assert_string(f"(box (id {number}) (size 1))")
                else:
                    env.eval(f"(modify {index} (size changed-{number}))")
            env.eval("(create$)")  # CLIPS frees values without holders
        there = [index for index, _, _ in env.facts("box")]
        assert sorted(row.index for row in copier.copy.rows) == sorted(there)
    finally:
        env.destroy()
