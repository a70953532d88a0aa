"""Reading of world.yaml."""

from __future__ import annotations

from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError
from cxbridge_explore.worldmodel.distributions import Distribution, Shape
from cxbridge_explore.worldmodel.model import DecisionTimes, PlannerModel, SkillFailure, WorldModel
from cxbridge_explore.worldmodel.reading import parse_world
from tests.support import ROOT

WORLD = """
skills:
  - name: say
    args: ["text=Hello.*"]
    duration: {uniform: [2, 4.5]}
    fails:
      - {error: hoarse, probability: 0.2, after: 0.5}
      - {error: mute, after: {normal: [1, 0.2], min: 0.1}}
    hangs: 0.01
otherwise: {fails: []}
sensed:
  - {interface: "BatteryInterface::Robot", field: current, values: [75, 3], at: [2, 1], after: [say]}
messages:
  - {interface: "SkillerInterface::Skiller", type: ExecSkill, lost: 0.2}
skillers:
  - {name: Skiller, back: 3, times: {every: 0.5, until: 4}}
killed:
  - {agent: robot1, times: {from: 1}, probability: 0.5}
planner: {none: 0.1, late: 0.2, delay: 3}
"""


def read(text: str) -> WorldModel:
    return parse_world(Configuration.from_text(text, "/x/world.yaml"))


def test_world_has_all_keys():
    world = read(WORLD)
    (say,) = world.skills
    assert (say.pattern.name, say.pattern.args, say.hang_probability) == ("say", {"text": "Hello.*"}, 0.01)
    assert say.failures == (
        SkillFailure("fails(hoarse)", "hoarse", 0.2, Distribution.constant(0.5)),
        SkillFailure("fails(mute)", "mute", 0.1, Distribution(Shape.NORMAL, (1.0, 0.2), 0.1, 1e9)),
    )
    assert say.duration is not None
    assert say.duration.representatives == (3.25, 2.0, 4.5)
    assert world.default_skill.failures == ()
    (sensed,) = world.sensed
    assert (sensed.weighted_values, sensed.times_s, sensed.skills) == (
        (("75", 0.9), ("3", 0.1)),
        (1.0, 2.0),
        ("say",),
    )
    (message,) = world.message_losses
    assert (message.message_type, message.probability) == ("ExecSkill", 0.2)
    assert world.absences[0].times == DecisionTimes(0.5, 0.0, 4.0)
    assert (world.kills[0].times, world.kills[0].restart_after_s) == (DecisionTimes(0.0, 1.0, 10.0), None)
    assert world.planner == PlannerModel(no_plan_probability=0.1, delay_probability=0.2, delay_s=3.0)


def test_example_of_manual_is_valid():
    page = (ROOT / "docs" / "explore.md").read_text()
    world = read(page.partition("## Worlds")[2].partition("```yaml")[2].partition("```")[0])
    assert world.skills
    assert world.planner
    assert world.kills


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("skils: []", 1, "skils is an unknown key(?s:.*)did you mean skills"),
        ("skills:\n  - {nam: say}", 2, "nam is an unknown key(?s:.*)did you mean name"),
        ("skills:\n  - {hangs: 0.5}", 2, "has no name"),
        ("skills: {say: 1}", 1, "must be a list"),
        ("skills: [say]", 1, "must be a list of maps"),
        ("skills: 3", 1, "must be a list of maps"),
        ("skills:\n  - name: say\n    hangs: 1.5", 3, "hangs is 1.5(?s:.*)0 to 1"),
        ("skills:\n  - name: say\n    hangs: -0.1", 3, "hangs is -0.1"),
        ("skills:\n  - name: say\n    duration: -1", 3, "duration is -1"),
        ("skills:\n  - name: say\n    duration: {uniform: [1]}", 3, "1 parameters(?s:.*)least, greatest"),
        ("skills:\n  - name: say\n    duration: {uniform: [3, 1]}", 3, "3, which is greater than 1"),
        ("skills:\n  - name: say\n    duration: {unifrom: [3, 1]}", 3, "did you mean uniform"),
        ("skills:\n  - name: say\n    duration: {normal: [1, 1], uniform: [0, 1]}", 3, "2 distributions"),
        ("skills:\n  - name: say\n    duration: {choice: [1], min: 3, max: 2}", 3, "less than the min"),
        ("skills:\n  - name: say\n    args: [text]", 3, "has 'text'"),
        ("otherwise: {fails: [{probability: 0.7}, {error: b, probability: 0.6}]}", 1, "sum is 1.3"),
        ("otherwise: {fails: [{error: b}, {error: b}]}", 1, r"has fails\(b\) twice"),
        ("planner: 1", 1, "must be a map"),
        ("killed: [{times: {from: 3, until: 2}}]", 1, "ends at 2, before 3"),
        ("killed: [{agent: a, back: -1}]", 1, "back is -1"),
        ("sensed: [{interface: A, field: b, values: [1]}]", 1, "at least two different values"),
        ("sensed: [{interface: A, field: b, values: [1, 2], probabilities: [1]}]", 1, "do not match"),
    ],
)
def test_invalid_world_is_error_with_line(text, line, message):
    with pytest.raises(CxbridgeError, match=message) as caught:
        read(text)
    assert (caught.value.file, caught.value.line) == ("/x/world.yaml", line)


scalars = st.one_of(
    st.floats(-2, 3, allow_nan=False),
    st.integers(-1, 5),
    st.sampled_from(["say", "min", "x=y", ""]),
    st.none(),
)
WORDS = (
    "skills otherwise sensed messages skillers killed name args fails duration hangs error after "
    "probability uniform normal choice min max interface field values at times every until"
)
names = st.sampled_from(WORDS.split())
trees = st.recursive(
    scalars,
    lambda inner: st.one_of(st.dictionaries(names, inner, max_size=4), st.lists(inner, max_size=3)),
    max_leaves=12,
)


@given(st.dictionaries(names, trees, max_size=4))
def test_random_world_is_read_or_refused(tree: dict[str, Any]):
    try:
        world = read(yaml.safe_dump(tree))
    except CxbridgeError:
        return
    for skill in (*world.skills, world.default_skill):
        assert skill.hang_probability + sum(each.probability for each in skill.failures) <= 1.001
