"""The test scenario on the built-in core: the transitions of a real Fawkes, and its facts at the end.

The test plays the skiller, so that scenario and core are tested in half a second.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from cxbridge.config import Configuration
from cxbridge.event_kinds import View
from cxbridge.events import Event, EventBus, Level, LogLine
from cxbridge.executive.executive import BUILTIN_CX, CoreFiles, Executive, read_action_mapping
from cxbridge.executive.features.config import ConfigFeature, RedefineWarningFeature
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge.executive.host.values import value_text
from cxbridge.executive.manager import HOST_LIBRARY, EnvironmentManager
from cxbridge.history.transitions import TRANSITION_TYPES, Transition
from cxbridge.skiller.mapping import ActionSkillMapping
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.formats.transitions_text import format_transition
from tests.executive.core.core_bench import Bench, StoppedClock
from tests.executive.fake_skiller import FakeSkiller
from tests.support import FAWKES_DIR, ROOT, SHARED, needs_fawkes, needs_shared

SCENARIO = ROOT / "scenarios" / "test-scenario"
PERIOD_US = 33_333
LOOPS = 600
"""Twenty seconds: the scenario needs about nine."""

RECORDINGS = sorted((SHARED / "traces" / "test-scenario").glob("*/fawkes.log"))


@dataclass
class Outcome:
    """A run of the scenario."""

    transitions: list[Transition] = field(default_factory=list)
    lines: list[LogLine] = field(default_factory=list)
    skill_strings: list[str] = field(default_factory=list)
    facts: list[tuple[str, dict[str, Any]]] = field(default_factory=list)
    seconds: float = 0.0
    over: bool = False

    def of(self, template: str) -> list[dict[str, Any]]:
        """Return the facts of a template at the end."""
        return [slots for name, slots in self.facts if name == template]


def run_scenario(
    library: Path = HOST_LIBRARY,
    core: Path = BUILTIN_CX,
    files: Path = SCENARIO,
    config_file: Path = SCENARIO / "scenario.yaml",
) -> Outcome:
    """Run the scenario to its end, at most twenty seconds of its clock.

    :param library: utils.clp, time.clp ...: ours, or Fawkes'.
    :param core: the CX core: ours, or Fawkes'.
    :param files: the folder of the scenario's files.
    """
    config = Configuration.load(config_file)
    clock = StoppedClock()
    bus = EventBus(clock)
    outcome = Outcome()

    def keep(event: Event) -> None:
        if isinstance(event, LogLine):
            outcome.lines.append(event)
        elif isinstance(event, TRANSITION_TYPES):
            outcome.transitions.append(event)

    bus.subscribe(keep, LogLine, *TRANSITION_TYPES)
    skiller = FakeSkiller(duration=30)
    features = [skiller, ConfigFeature(config), RedefineWarningFeature(), PddlParserFeature()]
    manager = EnvironmentManager(bus, features, library)
    mapping = ActionSkillMapping(read_action_mapping(config, "test"))
    executive = Executive(manager, config, mapping, CoreFiles(core, (files,)))
    executive.follow_transitions()
    executive.init()
    begin, seen = clock.now_us(), 0
    for _ in range(LOOPS):
        executive.loop()
        seen = skiller.loop(seen)
        clock.time_us += PERIOD_US
        if executive.is_over and next(executive.env.facts("test-performed"), None) is not None:
            break
    outcome.seconds = (clock.now_us() - begin) / 1e6
    outcome.over = executive.is_over and not list(executive.env.facts("goal"))
    outcome.facts = [(name, slots) for _, name, slots in executive.env.facts()]
    outcome.skill_strings = [
        str(m.fields["skill_string"]) for m in skiller.sent if m.type == "ExecSkillMessage"
    ]
    assert executive.env.faults == []
    manager.close()
    return outcome


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    """The scenario on the built-in core."""
    return run_scenario()


def texts(outcome: Outcome, level: Level) -> list[str]:
    """Return the lines of a level."""
    return [line.text for line in outcome.lines if line.level is level]


def same_as_recorded(outcome: Outcome, folder: Path) -> bool:
    """Whether the transitions equal those of all recordings, in partial order."""
    file = folder / "transitions.txt"
    lines = (format_transition(event).replace('\\"', '"') for event in outcome.transitions)
    file.write_text("\n".join(lines) + "\n")
    recorded = [open_run(path) for path in RECORDINGS]
    return compare_runs(open_run(file), recorded, View.TRANSITIONS, Order.PARTIAL).same


@needs_shared
def test_transitions_equal_recording_of_fawkes(outcome: Outcome, tmp_path: Path) -> None:
    assert len(RECORDINGS) == 3
    assert same_as_recorded(outcome, tmp_path)


@needs_shared
@needs_fawkes
def test_our_files_run_on_original_core(tmp_path: Path) -> None:
    assert FAWKES_DIR is not None
    plugins = FAWKES_DIR / "src" / "plugins"
    original = run_scenario(plugins / "clips" / "clips", plugins / "clips-executive" / "clips")
    assert same_as_recorded(original, tmp_path)


@needs_shared
@needs_fawkes
def test_original_files_run_on_our_core(tmp_path: Path) -> None:
    assert FAWKES_DIR is not None
    files = FAWKES_DIR / "src" / "plugins" / "clips-executive" / "clips"
    config_file = FAWKES_DIR / "cfg" / "conf.d" / "clips-executive.yaml"
    assert same_as_recorded(run_scenario(files=files, config_file=config_file), tmp_path)


def test_run_ends_without_goals_plans_and_skills(outcome: Outcome) -> None:
    assert outcome.over
    assert 5.0 < outcome.seconds < 15.0
    for template in ("goal", "plan", "plan-action", "skill", "skill-action-execinfo"):
        assert outcome.of(template) == []
    assert outcome.of("domain-pending-sensed-fact") == []


def test_skill_strings(outcome: Outcome) -> None:
    spoken = ("Hello peggy", "Good bye", "Hello again peggy", "Cleaning up")
    assert outcome.skill_strings == [f'say{{text="{text}", wait=true}}' for text in spoken]


def test_domain_facts_at_end(outcome: Outcome) -> None:
    facts = sorted((str(f["name"]), *map(str, f["param-values"])) for f in outcome.of("domain-fact"))
    assert facts == [("said", "bob", "hello"), ("said", "peggy", "goodbye"), ("said", "peggy", "hello")]


def test_world_model_at_end(outcome: Outcome) -> None:
    found = {fact["id"]: fact for fact in outcome.of("wm-fact")}
    assert found["/cx/identity"]["value"] == "executive"
    assert found["/config/coordination/mutex/max-age-sec"]["value"] == 15
    assert found["/config/coordination/mutex/renew-interval"]["value"] == 5
    assert sum(name.startswith("/domain/fact/said?") for name in found) == 3
    objects = {name.rsplit("/", 1)[1]: found[name]["values"] for name in found if "/objects-by-type/" in name}
    assert {kind: set(names) for kind, names in objects.items()} == {
        "howoften": set(),
        "name": {"lock1"},
        "text": {"goodbye", "hello"},
        "object": set(),
    }
    assert not any(name.startswith("/template/fact/goal") for name in found)


# --- the files of the scenario ----------------------------------------------------------------------------


@needs_shared
def test_actions_map_to_recorded_templates() -> None:
    ours = Configuration.load(SCENARIO / "scenario.yaml")
    recorded = Configuration.load(SHARED / "fawkes-data" / "config" / "clips-executive.yaml")
    assert read_action_mapping(ours, "test") == read_action_mapping(recorded, "test")


def domain_of(file: Path) -> set[str]:
    """Return the domain of a PDDL file, one text per fact."""
    bench = Bench("plan.clp", "goal.clp", "domain.clp")
    PddlParserFeature().init_context(bench.env)
    bench.env.call("parse-pddl-domain", str(file))
    facts = set()
    for template in ("object-type", "predicate", "operator", "operator-parameter", "effect"):
        for _, name, slots in bench.env.facts(f"domain-{template}"):
            if template == "effect":
                del slots["name"]  # a number from gensym
            facts.add(f"{name} {sorted((slot, value_text(value)) for slot, value in slots.items())}")
    bench.close()
    return facts


@needs_fawkes
def test_domain_equals_domain_of_fawkes() -> None:
    assert FAWKES_DIR is not None
    core = FAWKES_DIR / "src" / "plugins" / "clips-executive" / "clips"
    ours = domain_of(SCENARIO / "domain.pddl")
    assert len(ours) > 15
    assert ours == domain_of(core / "test-scenario" / "domain.pddl")
