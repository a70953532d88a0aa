"""Values of CLIPS as text."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cxbridge.clipstext.values import quoted
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value, clips_value, print_value, value_text

_TEXTS = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]))
_NUMBERS = st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False)
_ATOMS = _TEXTS | _TEXTS.map(Symbol) | _NUMBERS


@pytest.fixture(scope="module")
def values_env() -> Iterator[ClipsEnvironment]:
    env = ClipsEnvironment("values", EventBus(VirtualClock()))
    env.build("(defrule floats (floats ?) =>)")
    yield env
    env.destroy()


@given(value=_ATOMS | st.lists(_ATOMS).map(tuple))
def test_value_prints_like_equal_python_value(values_env: ClipsEnvironment, value: Value) -> None:
    assert print_value(clips_value(values_env.c_env, value)) == value_text(value)


@given(st.text(st.characters(exclude_categories=["Cc", "Cs"])))
def test_clips_reads_quoted_text_back(values_env: ClipsEnvironment, text: str) -> None:
    assert values_env.eval(quoted(text)) == text


@given(st.floats())
@example(1 / 3)
@example(1e15)
@example(100.0)
@example(-0.0)
@example(float("inf"))
@example(-float("nan"))
def test_floats_print_as_in_clips(values_env: ClipsEnvironment, value: float) -> None:
    text = values_env.call("str-cat", value)
    index = values_env.assert_ordered("floats", (value,))
    assert index is not None
    fact = values_env.maker.find_fact(index)
    assert value_text(value) == text
    assert values_env.api.fact_text(fact) == f"(floats {value_text(value)})"
    values_env.retract(index)


def test_follower_gets_requested_slots_only() -> None:
    env = ClipsEnvironment("follow", EventBus(VirtualClock()))
    env.build("(deftemplate goal (slot id) (multislot text) (slot rest))")
    came: list[dict[str, str]] = []
    gone: list[dict[str, str]] = []
    env.watcher.follow("goal", lambda _template, slots: came.append(slots), ("id", "text", "absent"))
    env.watcher.follow_retractions("goal", lambda _template, slots: gone.append(slots), ("id",))
    env.assert_fact("goal", {"id": Symbol("G1"), "text": ("a b", Symbol("c"), 1, 1 / 3, 1e15, 2.0)})
    assert came == [{"id": "G1", "text": '"a b" c 1 0.333333333333333 1e+15 2.0'}]
    env.eval("(retract *)")
    assert gone == [{"id": "G1"}]
    env.destroy()
