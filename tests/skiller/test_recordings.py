"""cxbridge writes the recorded values of Fawkes' interfaces in the recorded order."""

from __future__ import annotations

import csv
import io
from typing import Any

import pytest

from cxbridge.config import Configuration
from cxbridge.events import InterfaceWrite, LogLine
from cxbridge.skiller.make import make_speech, skill_folders
from cxbridge.skiller.simulation.make import make_simulator
from cxbridge.skiller.speech import LOADED_TEXT, estimate_duration
from cxbridge.trace.formats.registry import open_run
from tests.skiller.rig import Rig
from tests.support import FAWKES_DIR, SHARED, needs_fawkes, needs_shared

pytestmark = needs_shared

RUNS = SHARED / "traces" / "test-scenario"
TEXTS = ["Hello peggy", "Good bye", "Hello again peggy", "Cleaning up"]


def recorded_rows(run: str, interface: str) -> list[list[str]]:
    """Return the rows of an interface's CSV without the column of times."""
    (path,) = (RUNS / run / "bblogger-repaired").glob(f"*-{interface}-*.csv")
    text = path.read_text().partition("\n")[2]
    return [row[1:] for row in csv.reader(io.StringIO(text), delimiter=";", quoting=csv.QUOTE_NONE)]


def log_texts(run: str, component: str) -> list[tuple[str, str]]:
    """Return the levels and texts of a component's log lines."""
    lines = []
    for line in (RUNS / run / "fawkes.log").read_text(errors="replace").splitlines():
        head, found, text = line.partition(f" {component}: ")
        if found and " " not in head[2:]:
            lines.append((head[0], text))
    return lines


def run_scenario(rig: Rig) -> None:
    """Send the orders of the recorded runs, each after the end of its predecessor."""
    rig.loop()
    rig.send("AcquireControl", False)
    rig.loop(2)
    for text in TEXTS:
        rig.exec(f'say{{text="{text}", wait=true}}')
        for _ in range(2000):
            if rig.status != "S_RUNNING":
                break
            rig.loop()


def text_rows(rows: list[Any]) -> list[list[str]]:
    """Return rows with all values as text."""
    return [["" if value == "" else str(value) for value in row] for row in rows]


def expected_skiller_rows(run: str) -> list[list[str]]:
    rows = recorded_rows(run, "SkillerInterface-Skiller")
    return [[row[0], row[1], "controller" if row[2] else "", row[3], row[4]] for row in rows]


def our_skiller_rows(rig: Rig) -> list[list[str]]:
    rows = rig.writes("skill_string", "error", "exclusive_controller", "msgid", "status")
    return text_rows([(a, b, "controller" if c else "", d, e) for a, b, c, d, e in rows])


@pytest.mark.parametrize("run", ["skiller-1", "skiller-2"])
@pytest.mark.parametrize(
    "fawkes", [pytest.param(False, id="ours"), pytest.param(True, id="fawkes", marks=needs_fawkes)]
)
def test_skiller_writes_recorded_values(run: str, fawkes: bool):
    rig = Rig()
    rig.lua(skill_folders(fawkes_dir=FAWKES_DIR if fawkes else None))
    rig.add(make_speech(rig.board, rig.clock, rig.bus))
    run_scenario(rig)
    assert our_skiller_rows(rig) == expected_skiller_rows(run)


@needs_fawkes
def test_skiller_logs_recorded_lines():
    rig = Rig()
    rig.lua(skill_folders(fawkes_dir=FAWKES_DIR))
    rig.add(make_speech(rig.board, rig.clock, rig.bus))
    run_scenario(rig)
    ours = [
        (event.level.value, event.text)
        for event in rig.events
        if isinstance(event, LogLine) and event.component == "SkillerLua"
    ]
    theirs = log_texts("skiller-1", "SkillerLua")

    def normalise(lines: list[tuple[str, str]]) -> list[tuple[str, str]]:
        normalised = []
        for level, text in lines:
            _, found, rest = text.partition(" (serial ")
            normal_text = f"SENDER {rest.partition(') ')[2]}" if found else text
            for sender in ("ClipsExecutiveThread", "MainThread"):
                normal_text = normal_text.replace(sender, "SENDER")
            normalised.append((level, normal_text))
        return normalised

    assert normalise(ours) == normalise(theirs)


@pytest.mark.parametrize("run", ["skiller-1", "skiller-2"])
@needs_fawkes
def test_graphs_equal_recorded_graphs(run: str):
    rig = Rig()
    rig.lua(skill_folders(fawkes_dir=FAWKES_DIR))
    rig.add(make_speech(rig.board, rig.clock, rig.bus))
    run_scenario(rig)
    (path,) = (RUNS / run / "bblogger").glob("*-SkillerDebugInterface-*.log")
    fields = ("graph_fsm", "graph", "graph_dir", "graph_colored")
    theirs = [
        tuple(getattr(event.values[field], "name", event.values[field]) for field in fields)
        for event in open_run(path)
        if isinstance(event, InterfaceWrite)
    ]
    assert len(theirs) == 9
    assert rig.writes(*fields, uid="SkillerDebugInterface::Skiller") == theirs


def test_speech_writes_recorded_values():
    rig = Rig()
    rig.add(make_speech(rig.board, rig.clock, rig.bus, greeting=LOADED_TEXT))
    rig.loop(60)
    rig.lua()
    run_scenario(rig)
    ours = rig.writes("text", "msgid", "final", uid="SpeechSynthInterface::Flite")
    theirs = [
        (text, int(msgid), final == "true")
        for text, msgid, final, _ in recorded_rows("skiller-1", "SpeechSynthInterface-Flite")
    ]
    assert ours == theirs


def test_estimated_durations_are_near_recorded_durations():
    for text, _, _, duration in recorded_rows("skiller-1", "SpeechSynthInterface-Flite"):
        assert abs(estimate_duration(text) - float(duration)) < 0.13


def test_simulator_writes_recorded_values():
    rig = Rig()
    config = Configuration.load(SHARED / "fawkes-data" / "config" / "execution-time-estimator.yaml")
    rig.add(make_simulator(rig.board, rig.clock, rig.bus, config=config))
    run_scenario(rig)
    assert our_skiller_rows(rig) == expected_skiller_rows("simulator-1")
    ours = [
        (event.level.value, event.text.replace("MainThread", "ClipsExecutiveThread"))
        for event in rig.events
        if isinstance(event, LogLine) and event.component == "SkillerSimulatorExecutionThread"
    ]
    theirs = log_texts("simulator-1", "SkillerSimulatorExecutionThread")
    assert ours[1:] == theirs[1:]  # the first line has a serial
