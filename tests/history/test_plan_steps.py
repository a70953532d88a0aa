"""Plans as text."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.history.plan_steps import PlannedAction, parse_plan_text, plan_text

names = st.from_regex(r"[a-zA-Z][a-zA-Z0-9_@.-]{0,8}", fullmatch=True)
times = st.none() | st.floats(0, 1e9)
actions = st.builds(PlannedAction, names, st.lists(names, max_size=4).map(tuple), times, times)


@given(st.lists(actions, max_size=6).map(tuple))
def test_plan_text_is_parsed_exactly(plan: tuple[PlannedAction, ...]) -> None:
    assert parse_plan_text(plan_text(plan)) == plan


def test_plan_text_has_times_and_arguments() -> None:
    plan = [PlannedAction("serve", ("egg",), 4.5, 2.0), PlannedAction("noop")]
    assert plan_text(plan) == "4.5: (serve egg) [2.0]\n(noop)"


def test_invalid_plan_is_refused() -> None:
    with pytest.raises(ValueError, match="not an action of a plan: 'serve egg'"):
        parse_plan_text("serve egg")
