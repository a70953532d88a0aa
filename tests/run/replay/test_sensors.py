"""Interfaces of sensors: the executive of a replay gets the recorded values in the recorded loops."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from cxbridge.errors import TraceError
from cxbridge.event_kinds import View
from cxbridge.events import Event, FactChange, InterfaceWrite, LogLine
from cxbridge.mainloop import Hook
from cxbridge.run import Run, RunOptions, run_scenario
from cxbridge.run.recording import start_recording
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.registry import open_run
from tests.run.mini import AGENT, write_scenario
from tests.run.replay.test_run_replay import rewrite

SENSE = """
(defrule sense-open
  "The template comes with the interface, so the rule that needs it comes after."
  (executive-initialized)
  (not (sensing))
  =>
  (assert (sensing))
  (blackboard-open-reading "SwitchInterface" "door")
  (build "(defrule sense-select
    ?g <- (goal (id G) (mode FORMULATED))
    (skiller-control (acquired TRUE))
    (SwitchInterface (value ?value&:(> ?value 4.5)) (time ?s ?us))
    =>
    (printout t \\"The door is open at \\" ?s \\" \\" ?us \\" now \\" (now) crlf)
    (modify ?g (mode SELECTED)))"))
"""
DOOR = "SwitchInterface::door"


def agent(more: str = SENSE) -> str:
    """The agent of the small scenario, with another condition to begin."""
    begin = AGENT.index("(defrule mini-select")
    return AGENT[:begin] + more + AGENT[AGENT.index("(defrule mini-expand") :]


def record(folder: Path) -> Path:
    """Record a run with a door that opens by a tenth per loop."""
    write_scenario(folder, agent=agent())
    options = RunOptions(scenario=folder, trace=folder / "run.mcap", trace_level="facts")
    with Run(options) as assembly:
        recorder = start_recording(assembly, options)
        door: Any = assembly.board.open_for_writing("SwitchInterface", "door", owner="the door")

        def move() -> None:
            door.value += 0.1
            door.write()

        assembly.start()
        assembly.loop.add(Hook.ACT, move)
        assembly.loop.run(lambda: assembly.is_over or assembly.loop.cycle_count > 1000)
        assembly.finalize()
        recorder.close()
    return folder / "run.mcap"


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("door"))


def facts(path: Path, template: str) -> list[tuple[int, str]]:
    """The facts of a template with their times."""
    return [
        (event.time_us, event.text)
        for event in open_run(path)
        if isinstance(event, FactChange) and event.asserted and event.template == template
    ]


def lines(path: Path) -> list[str]:
    return [e.text for e in open_run(path) if isinstance(e, LogLine) and "The door is open" in e.text]


def test_writes_arrive_in_their_loops_with_stamps(recording: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.mcap"
    result = run_scenario(
        RunOptions(scenario=recording.parent, replay=(recording,), trace=again, trace_level="facts")
    )
    assert result.status == 0, result.summary()
    seen = facts(recording, "SwitchInterface")
    assert len(seen) > 40
    assert facts(again, "SwitchInterface") == seen
    assert lines(again) == lines(recording) != []
    assert compare_runs(open_run(again), [open_run(recording)], View.FACTS, Order.TOTAL).same


def test_different_sensor_value_is_divergence(recording: Path) -> None:
    def close_door(event: Event) -> Event:
        if isinstance(event, InterfaceWrite) and event.uid == DOOR:
            return replace(event, values=dict(event.values) | {"value": 0.0})
        return event

    result = run_scenario(
        RunOptions(scenario=recording.parent, replay=(rewrite(recording, close_door, "shut.mcap"),))
    )
    assert result.status == 1
    assert "got nothing" in result.reason


def test_agent_may_open_recorded_interface_for_writing(recording: Path, tmp_path: Path) -> None:
    other = SENSE.replace(
        '(blackboard-open-reading "SwitchInterface" "door")',
        '(blackboard-open-writing "SwitchInterface" "door")'
        ' (blackboard-open-reading "SwitchInterface" "door")'
        ' (blackboard-set "SwitchInterface::door" "value" 7.0) (blackboard-write "SwitchInterface::door")',
    )
    scenario = write_scenario(tmp_path, agent=agent(other))
    trace = tmp_path / "again.mcap"
    result = run_scenario(RunOptions(scenario=scenario, replay=(recording,), trace=trace))
    assert result.status == 0, result.summary()
    writes = [e for e in open_run(trace) if isinstance(e, InterfaceWrite) and e.uid == DOOR]
    assert [event.values["value"] for event in writes] == [7.0]


def test_changed_definition_of_sensor_is_one_error(recording: Path) -> None:
    def change(event: Event) -> Event:
        if isinstance(event, InterfaceWrite) and event.uid == DOOR:
            return replace(event, values=dict(event.values) | {"colour": "red"})
        return event

    with pytest.raises(TraceError, match="only the recording has colour"):
        run_scenario(RunOptions(scenario=recording.parent, replay=(rewrite(recording, change, "red.mcap"),)))


def test_unknown_type_is_skipped_with_warning(recording: Path, tmp_path: Path) -> None:
    def change(event: Event) -> Event:
        if isinstance(event, InterfaceWrite) and event.uid == "SpeechSynthInterface::Flite":
            return replace(event, uid="OddInterface::o")
        return event

    events: list[Any] = []
    result = run_scenario(
        RunOptions(scenario=recording.parent, replay=(rewrite(recording, change, "odd.mcap"),)),
        console=events.append,
    )
    assert result.status == 0
    assert any("OddInterface::o is not replayed" in event.text for event in events)
