"""Skill files of a Fawkes checkout run unchanged in their folder, and so do the shipped skills."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.skiller.make import make_speech, skill_folders
from tests.skiller.rig import Rig
from tests.support import FAWKES_DIR

FOLDERS = [
    pytest.param(None, id="ours"),
    pytest.param(
        FAWKES_DIR,
        id="fawkes",
        marks=pytest.mark.skipif(FAWKES_DIR is None, reason="FAWKES_DIR names no Fawkes checkout"),
    ),
]
pytestmark = pytest.mark.parametrize("fawkes_dir", FOLDERS)


def make(fawkes_dir: Path | None, *, speech: bool = True) -> Rig:
    rig = Rig()
    rig.lua(skill_folders(fawkes_dir=fawkes_dir))
    if speech:
        rig.add(make_speech(rig.board, rig.clock, rig.bus))
    return rig


def voice(rig: Rig) -> Any:
    return rig.board.open_for_reading("SpeechSynthInterface", "Flite", owner="test")


def test_say_waits_for_end_of_speech(fawkes_dir: Path | None):
    rig = make(fawkes_dir)
    listener = voice(rig)
    rig.exec('say{text="Hello peggy", wait=true}')
    listener.read()
    assert (listener.text, listener.final, rig.status) == ("Hello peggy", False, "S_RUNNING")
    loops = 0
    while rig.status == "S_RUNNING" and loops < 60:
        rig.loop()
        loops += 1
    listener.read()
    assert (listener.final, rig.status) == (True, "S_FINAL")
    # 1.11 s at 30 loops a second, and a loop for the result
    assert loops == 35


def test_say_without_wait_is_final_at_once(fawkes_dir: Path | None):
    rig = make(fawkes_dir)
    rig.exec('say{text="Hello"}')
    assert rig.status == "S_FINAL"


def test_say_fails_without_a_voice(fawkes_dir: Path | None):
    rig = make(fawkes_dir, speech=False)
    rig.exec('say{text="Hello"}')
    assert rig.status == "S_FAILED"
    assert rig.state.error in ("No SpeechSynth provider", "there is no speech synthesis")


def test_say_fails_after_replacement_of_its_text(fawkes_dir: Path | None):
    rig = make(fawkes_dir, speech=False)
    writer: Any = rig.board.open_for_writing("SpeechSynthInterface", "Flite", owner="test")
    rig.exec('say{text="Hello", wait=true}')
    for msgid, text in ((writer.msgq_pop().id, "Hello"), (99, "another")):
        assert rig.status == "S_RUNNING"
        writer.msgid, writer.text = msgid, text
        writer.write()
        rig.loop()
    assert rig.status == "S_FAILED"


@pytest.mark.parametrize(
    ("skill_string", "loops"),
    [
        ('moveto{place="there"}', 31),
        ('moveto{place="there", duration=0.2}', 8),
        ("relmoveto{x=1, y=0, duration=0.2}", 8),
    ],
)
def test_pretended_moves_take_configured_time(fawkes_dir: Path | None, skill_string: str, loops: int):
    rig = make(fawkes_dir)
    rig.exec(skill_string)
    needed = 0
    while rig.status == "S_RUNNING":
        rig.loop()
        needed += 1
    assert rig.status == "S_FINAL"
    assert abs(needed - loops) <= 1


@pytest.mark.parametrize(
    "skill_string", ["moveto{}", "relmoveto{x=1}", 'moveto{place="x", duration=0, error_prob=1}']
)
def test_pretended_moves_fail(fawkes_dir: Path | None, skill_string: str):
    rig = make(fawkes_dir)
    rig.exec(skill_string, loops=3)
    assert rig.status == "S_FAILED"
