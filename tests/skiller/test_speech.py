"""The writer of SpeechSynthInterface, and its voices."""

from __future__ import annotations

import os
import shutil
import sys
import types
from pathlib import Path
from typing import Any

import pytest

from cxbridge.errors import SkillerError
from cxbridge.events import Level
from cxbridge.skiller.make import make_speech
from cxbridge.skiller.speech import SpeakerVoice, SpeechSynthWriter, Voice
from tests.skiller.rig import Rig


class SlowVoice(Voice):
    """A voice that a test finishes."""

    def __init__(self) -> None:
        self.spoken: list[str] = []
        self.done = False

    def start(self, text: str) -> float:
        self.spoken.append(text)
        self.done = False
        return 2.5

    def is_done(self) -> bool:
        return self.done


def order(rig: Rig, text: str) -> int:
    reader: Any = rig.board.open_for_reading("SpeechSynthInterface", "Flite", owner="test")
    number: int = reader.msgq_enqueue(reader.SayMessage(text))
    return number


UID = "SpeechSynthInterface::Flite"


def test_orders_are_spoken_in_sequence():
    rig, voice = Rig(), SlowVoice()
    rig.add(SpeechSynthWriter(rig.board, rig.clock, rig.bus, voice=voice))
    order(rig, "one")
    order(rig, "two")
    rig.loop(3)
    assert voice.spoken == ["one"]
    voice.done = True
    rig.loop()
    voice.done = True
    rig.loop()
    assert rig.writes("text", "final", "duration", uid=UID) == [
        ("one", False, 2.5),
        ("one", True, 2.5),
        ("two", False, 2.5),
        ("two", True, 2.5),
    ]


def test_missing_voice_is_error_with_package(monkeypatch: pytest.MonkeyPatch, player: Path):
    broken: Any = types.ModuleType("pyttsx3")

    def init() -> None:
        raise RuntimeError("eSpeak or eSpeak-ng not installed on this system")

    broken.init = init
    monkeypatch.setitem(sys.modules, "pyttsx3", broken)
    rig = Rig()
    with pytest.raises(SkillerError, match="speech is not available: eSpeak") as caught:
        make_speech(rig.board, rig.clock, rig.bus, speech="on")
    assert "espeak-ng" in str(caught.value)


def test_missing_player_is_error_with_package(monkeypatch: pytest.MonkeyPatch):
    """pyttsx3 would be silent without an error."""
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    with pytest.raises(SkillerError, match="'aplay' is missing") as caught:
        SpeakerVoice()
    assert "apt install alsa-utils" in str(caught.value)


@pytest.fixture
def player(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A program aplay that copies the files to be played into the returned folder."""
    folder = tmp_path / "played"
    folder.mkdir()
    program = tmp_path / "aplay"
    program.write_text(f'#!/bin/sh\ncp "$1" "{folder}/"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    return folder


def test_failed_text_is_logged_and_next_text_spoken(monkeypatch: pytest.MonkeyPatch, player: Path):
    spoken: list[str] = []

    class Engine:
        def say(self, text: str) -> None:
            spoken.append(text)
            if text == "bad":
                raise RuntimeError("no such voice")

        def runAndWait(self) -> None:  # noqa: N802 - pyttsx3's name
            self.finished(name=None, completed=True)

        def connect(self, topic: str, callback: Any) -> None:
            assert topic == "finished-utterance"
            self.finished = callback

    fake: Any = types.ModuleType("pyttsx3")
    fake.init = Engine
    monkeypatch.setitem(sys.modules, "pyttsx3", fake)
    rig = Rig()
    voice = SpeakerVoice()
    speech = rig.add(SpeechSynthWriter(rig.board, rig.clock, rig.bus, voice=voice))
    for text in ("bad", "good"):
        order(rig, text)
        rig.loop()
        assert voice._done_event.wait(20)
        rig.loop()
    assert rig.logged(Level.ERROR) == ["cannot say 'bad': no such voice"]
    speech.close()
    voice._thread.join(timeout=5)
    assert (spoken, voice.is_done()) == (["bad", "good"], True)


def test_equal_order_id_of_another_client_does_not_end_skill():
    """The end of the first text ended the skill before its own text began."""
    rig, voice = Rig(), SlowVoice()
    rig.add(SpeechSynthWriter(rig.board, rig.clock, rig.bus, voice=voice))
    rig.lua()
    other: Any = rig.board.open_for_reading("SpeechSynthInterface", "Flite", owner="other")
    assert other.msgq_enqueue(other.SayMessage("theirs")) == 1  # the id of the skill's order, too
    rig.loop()
    voice.done = True
    rig.loop()
    rig.send("AcquireControl")
    rig.exec('say{text="mine", wait=true}', loops=3)
    assert (rig.status, voice.spoken) == ("S_RUNNING", ["theirs", "mine"])
    voice.done = True
    rig.loop(3)
    assert rig.status == "S_FINAL"


def test_lost_order_fails():
    rig = Rig()
    writer: Any = rig.board.open_for_writing("SpeechSynthInterface", "Flite", owner="deaf")
    writer.final = True
    writer.write()
    rig.lua()
    rig.send("AcquireControl")
    rig.exec('say{text="mine", wait=true}', loops=70)
    assert (rig.status, rig.state.error) == ("S_FAILED", "the order was lost")
