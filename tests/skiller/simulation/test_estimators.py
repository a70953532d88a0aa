"""Estimators of simulated skills: their order, lookup, failures, configuration."""

from __future__ import annotations

import random
import re
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError, SkillerError
from cxbridge.events import Level
from cxbridge.skiller.simulation.deciders import Decider, Outcome
from cxbridge.skiller.simulation.estimators import (
    EstimatorSettings,
    SkillPattern,
    StaticEstimator,
)
from cxbridge.skiller.simulation.faults import Failure, FailureInjector
from cxbridge.skiller.simulation.make import make_simulator
from cxbridge.skiller.simulation.recorded import LookupEstimator, Sample
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from cxbridge.skiller.skillstring import SkillStringCall, parse_skill_call
from cxbridge.skiller.status import Status
from tests.skiller.rig import Rig
from tests.support import ROOT


class Fixed(Decider):
    """Estimates all skills except ``unknown``."""

    def __init__(self, priority: int, seconds: float) -> None:
        self.priority = priority
        self.seconds = seconds

    def decide(self, call: SkillStringCall) -> Outcome | None:
        return None if call.name == "unknown" else Outcome(self.seconds)


def simulate(rig: Rig, *deciders: Decider, **more: Any) -> SkillerSimulator:
    simulator: SkillerSimulator = rig.add(SkillerSimulator(rig.board, rig.clock, rig.bus, deciders, **more))
    return simulator


def end(rig: Rig, text: str) -> tuple[str, str, float]:
    """Execute a skill string; return its status, error and logged duration."""
    rig.forget()
    rig.exec(text)
    duration = re.search(r"will take ([0-9.]+) seconds", rig.logged(Level.INFO)[-1])
    assert duration is not None
    for _ in range(10_000):
        if rig.status != "S_RUNNING":
            break
        rig.loop()
    return rig.status, rig.state.error, float(duration[1])


# -- providers (section 6: "Estimators")


def test_highest_priority_decides_then_first_registration():
    rig = Rig()
    simulate(rig, Fixed(-1, 3.0), Fixed(3, 1.0), Fixed(3, 2.0))
    assert end(rig, "go{}")[2] == 1.0


def test_calls_end_with_last_call_or_first_failure():
    rig = Rig()
    failing = FailureInjector(
        [
            Failure(SkillPattern("bad"), calls=[1, 2], error="no", after=0.5),
            Failure(SkillPattern("slow"), calls=[3], error="late"),
        ]
    )
    slow = StaticEstimator(whitelist=[SkillPattern("slow", seconds=4.0)], seconds=1.0)
    simulate(rig, slow, failing)
    assert end(rig, "slow{} fast{}") == ("S_FINAL", "", 4.0)
    for _ in range(2):  # slow fails in the second round
        assert end(rig, "slow{} bad{}") == ("S_FAILED", "no", 0.5)


class Effects(Decider):
    """Gives each skill an effect at its end; another decider gives the duration."""

    priority = 9

    def __init__(self) -> None:
        self.skills: list[str] = []

    def decide(self, call: SkillStringCall) -> Outcome | None:
        return Outcome(then=lambda: self.skills.append(call.name))


def test_effect_happens_once_at_end_and_not_after_abort():
    rig, effects = Rig(), Effects()
    simulate(rig, effects, StaticEstimator(seconds=2.0))
    rig.exec("aborted{}")
    assert end(rig, "pick{} place{}") == ("S_FINAL", "", 2.0)
    rig.loop()
    assert effects.skills == ["pick", "place"]


def test_failure_takes_share_of_next_duration():
    failure = Outcome(None, Status.S_FAILED, "slipped", share=0.25)
    assert failure.complete_with(Outcome(4.0)) == Outcome(1.0, Status.S_FAILED, "slipped")
    assert failure.complete_with(Outcome()) == failure
    broken = Outcome(4.0, Status.S_FAILED, "broken")
    assert Outcome().complete_with(broken) == broken


@pytest.mark.parametrize(
    ("settings", "allowed"),
    [
        (EstimatorSettings(), True),
        (EstimatorSettings(whitelist=[SkillPattern("other")]), False),
        (EstimatorSettings(whitelist=[SkillPattern("say", {"text": "hi.*"})]), True),
        (EstimatorSettings(whitelist=[SkillPattern("say", {"text": "hi"})]), False),  # the whole value
        (EstimatorSettings(whitelist=[SkillPattern("say", {"more": ".*"})]), False),  # no such argument
        (EstimatorSettings(blacklist=[SkillPattern("say")]), False),
        (
            EstimatorSettings(
                whitelist=[SkillPattern("say")], blacklist=[SkillPattern("say", {"text": "x"})]
            ),
            True,
        ),
    ],
)
def test_white_and_black_lists_select_calls(settings: EstimatorSettings, allowed: bool):
    assert settings.allows(parse_skill_call('say{text="hi you"}')) is allowed


def test_entry_without_duration_has_default():
    call, entries = parse_skill_call("say{}"), [SkillPattern("say")]
    assert StaticEstimator(entries, seconds=1.0).decide(call) == Outcome(1.0)


# -- lookup


PICKS = [
    Sample('pick{what="cup", from="A"}', 2.0),
    Sample('pick{what="cup", from="B"}', 4.0),
    Sample('pick{what="pot", from=".*"}', 6.0),
    Sample('pick{what="cup", from="A"}', 1.0, Status.S_FAILED, "slipped"),
    Sample("pick{} put{}", 99.0),  # several calls: the duration of each is unknown
    Sample("not a call", 99.0),
]


def draws(estimator: LookupEstimator, text: str, times: int = 200) -> Counter[Any]:
    return Counter(estimator.decide(parse_skill_call(text)) for _ in range(times))


def test_lookup_draws_from_executions_with_same_arguments():
    estimator = LookupEstimator(PICKS)
    assert set(draws(estimator, 'pick{what="cup", from="A"}')) == {Outcome(2.0)}
    assert set(draws(estimator, 'pick{what="cup"}')) == {Outcome(2.0), Outcome(4.0)}
    assert set(draws(estimator, 'pick{what="pot", from="Z"}')) == {Outcome(6.0)}
    assert set(draws(estimator, 'pick{what="jar"}')) == {None}
    assert set(draws(estimator, "sing{}")) == {None}


def test_lookup_includes_failures_on_request():
    estimator = LookupEstimator(PICKS, include_failures=True)
    slipped = Outcome(1.0, Status.S_FAILED, "slipped")
    outcomes = draws(estimator, 'pick{what="cup", from="A"}')
    assert set(outcomes) == {Outcome(2.0), slipped}
    assert 60 < outcomes[slipped] < 140


def test_lookup_without_full_match_uses_whitelist_pattern():
    entry = SkillPattern("pick", {"what": "c.*"})
    chosen = EstimatorSettings(whitelist=[entry], speed=2.0)
    estimator = LookupEstimator(PICKS, chosen, fully_match_args=False)
    assert set(draws(estimator, 'pick{what="cap", from="Z"}')) == {Outcome(1.0), Outcome(2.0)}
    assert set(draws(estimator, 'pick{what="pot"}')) == {None}


def test_same_seed_gives_same_draws():
    def run(seed: int) -> list[Any]:
        estimator = LookupEstimator(PICKS, rng=random.Random(seed))
        return [estimator.decide(parse_skill_call("pick{}")) for _ in range(20)]

    assert run(1) == run(1) != run(2)


# -- failures


def test_nth_call_fails_with_given_error():
    rig = Rig()
    failures = FailureInjector(
        [
            Failure(SkillPattern("pick", {"what": "cup"}), calls=[2], error="slipped"),
            Failure(SkillPattern("pick"), calls=[1, 4], error="broken"),
        ]
    )
    simulate(rig, StaticEstimator(seconds=0.0), failures)
    ends = [end(rig, f'pick{{what="{item}"}}')[:2] for item in ("pot", "cup", "cup", "pot", "pot")]
    assert ends == [
        ("S_FAILED", "broken"),
        ("S_FINAL", ""),
        ("S_FAILED", "slipped"),
        ("S_FAILED", "broken"),
        ("S_FINAL", ""),
    ]


# -- the configuration


def load(text: str, folder: Path) -> Configuration:
    file = folder / "config.yaml"
    file.write_text(text)
    return Configuration.load(file)


def read_picks(path: Path) -> list[Sample]:
    """Return samples in place of a reader of recorded runs."""
    if path.name == "empty.log":
        return []
    assert path.name == "monday.mcap"
    assert path.parent.is_dir()
    return [*PICKS, Sample('say{text="hello you"}', 42.0), Sample('moveto{place="A"}', 43.0)]


def test_example_of_documentation_works(tmp_path: Path):
    page = (ROOT / "docs" / "skiller.md").read_text()
    example = page.partition("## The simulator")[2].partition("```yaml\n")[2].partition("```")[0]
    (tmp_path / "runs").mkdir()
    rig = Rig()
    config = load(example, tmp_path)
    rig.add(make_simulator(rig.board, rig.clock, rig.bus, config=config, read_samples=read_picks))
    assert end(rig, 'say{text="hello you"}') == ("S_FINAL", "", 42.0)
    assert end(rig, 'say{text="hello me", wait=true}') == ("S_FINAL", "", 8.5)
    assert end(rig, 'moveto{place="A"}') == ("S_FINAL", "", 1.5)
    picks = [end(rig, 'pick{what="cup-1"}') for _ in range(3)]
    assert picks[2] == ("S_FAILED", "gripper broken", 1.5)
    assert rig.logged(Level.INFO)[-1] == "Skill 'pick{what=\"cup-1\"}' failed: gripper broken"


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("plugins/execution-time-estimator/static: {speed: 0}", 1, "a speed must be above 0"),
        ("plugins/execution-time-estimator/static: {exec-time: -1}", 1, "seconds, from 0"),
        (
            "plugins/execution-time-estimator/static/whitelist/a:\n  name: say\n  args: ['text=(']",
            3,
            "a regular expression",
        ),
        (
            "plugins/execution-time-estimator/static/blacklist/a:\n  name: say\n  args: [text]",
            3,
            "NAME=PATTERN",
        ),
        ("plugins/execution-time-estimator/lookup:\n  recordings: empty.log", 2, "in which no skill ends"),
        ("plugins/skiller-simulator/failures/a:\n  name: say\n  probability: 2", 3, "a number from 0 to 1"),
        ("plugins/skiller-simulator/failures/a:\n  name: say", 2, "needs 'name', and 'probability' or"),
        ("plugins/skiller-simulator/failures/a:\n  name: say\n  calls: [0]", 3, "counted from 1"),
        (
            "plugins/skiller-simulator/failures/a:\n  name: say\n  every: 3",
            2,
            "is not a setting of a failure",
        ),
    ],
)
def test_invalid_configuration_is_error_with_place(tmp_path: Path, text: str, line: int, message: str):
    rig = Rig()
    with pytest.raises(SkillerError) as caught:
        make_simulator(rig.board, rig.clock, rig.bus, config=load(text, tmp_path), read_samples=read_picks)
    assert message in str(caught.value)
    assert (caught.value.file or "").endswith("config.yaml")
    assert caught.value.line in (line, line + 1)


def test_missing_recordings_are_one_error(tmp_path: Path):
    from cxbridge.run.skill_history import read_samples

    rig = Rig()
    config = load("plugins/execution-time-estimator/lookup:\n  recordings: runs/none.mcap", tmp_path)
    with pytest.raises(CxbridgeError, match="No such file") as caught:
        make_simulator(rig.board, rig.clock, rig.bus, config=config, read_samples=read_samples)
    assert caught.value.file == str(tmp_path / "runs" / "none.mcap")
