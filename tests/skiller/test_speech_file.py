"""Speech into sound files, with the voice that is installed."""

from __future__ import annotations

import array
import os
import shutil
import sys
import tempfile
import wave
from pathlib import Path
from typing import Any

import pytest

from cxbridge.errors import CxbridgeError, SkillerError
from cxbridge.events import Level
from cxbridge.run.options import RunOptions, is_speech_target
from cxbridge.skiller import speech_file
from cxbridge.skiller.make import make_speech
from cxbridge.skiller.speech import SpeakerVoice
from cxbridge.skiller.speech_file import FileVoice
from tests.skiller.rig import Rig
from tests.skiller.test_speech import UID, order, player

__all__ = ["player"]  # a fixture

needs_voice = pytest.mark.skipif(
    shutil.which("espeak-ng") is None, reason="espeak-ng is not installed: no voice to test with"
)


def sound(file: Path) -> tuple[float, float]:
    """Return the length in seconds and the loudness, root mean square of full scale."""
    with wave.open(str(file), "rb") as opened:
        assert (opened.getnchannels(), opened.getsampwidth()) == (1, 2)
        samples = array.array("h", opened.readframes(opened.getnframes()))
        assert len(samples) == opened.getnframes()
        seconds = len(samples) / opened.getframerate()
    return seconds, (sum(x * x for x in samples) / max(1, len(samples))) ** 0.5 / 2**15


def say(rig: Rig, *texts: str) -> None:
    for text in texts:
        order(rig, text)
        rig.loop()
        while rig.writes("final", uid=UID)[-1] is False:
            rig.loop()


@needs_voice
def test_one_file_holds_all_texts_and_each_takes_as_long_as_its_sound(tmp_path: Path):
    rig, file = Rig(), tmp_path / "run.wav"
    speech = rig.add(make_speech(rig.board, rig.clock, rig.bus, speech=str(file)))
    start = rig.clock.now_us()
    say(rig, "Hello peggy")
    first = sound(file)  # whole after each text
    say(rig, "Cleaning up the kitchen")
    took = (rig.clock.now_us() - start) / 1e6
    speech.close()
    seconds, loudness = sound(file)
    assert 0.5 < first[0] < 1.6 < seconds < 4.0
    assert min(first[1], loudness) > 0.02  # not silent
    durations = rig.writes("duration", uid=UID)
    assert durations[0] + durations[-1] == pytest.approx(seconds, abs=0.001)
    assert seconds < took < seconds + 0.4


@needs_voice
def test_a_folder_gets_one_file_a_text(tmp_path: Path):
    rig, folder = Rig(), tmp_path / "new" / "texts"
    rig.add(make_speech(rig.board, rig.clock, rig.bus, speech=f"{folder}/"))
    say(rig, "Hello, Peggy!", "-w /etc/passwd", "\N{HIRAGANA LETTER A}", "")
    names = sorted(file.name for file in folder.iterdir())
    assert names == ["001-hello-peggy.wav", "002-w-etc-passwd.wav", "003.wav", "004.wav"]
    assert all(sound(folder / name)[1] > 0.02 for name in names[:3])
    assert sound(folder / "004.wav")[0] < 0.1


@needs_voice
@pytest.mark.skipif(" " in tempfile.gettempdir(), reason="pyttsx3's player loses paths with a blank")
def test_pyttsx3_speaks_to_the_player(player: Path):
    voice = SpeakerVoice()
    assert 0.5 < voice.start("Hello peggy") < 2.0
    assert voice._done.wait(20)
    assert voice.trouble() == ""
    voice.close()
    (played,) = player.iterdir()
    seconds, loudness = sound(played)
    assert 0.4 < seconds < 1.6
    assert loudness > 0.02


def test_without_a_voice_there_is_one_clear_message_and_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    monkeypatch.setattr(speech_file, "_PYTTSX3", "raise RuntimeError('eSpeak or eSpeak-ng not installed')")
    rig = Rig()
    with pytest.raises(SkillerError, match="eSpeak or eSpeak-ng not installed") as caught:
        make_speech(rig.board, rig.clock, rig.bus, speech=str(tmp_path / "run.wav"))
    assert "apt install espeak-ng" in str(caught.value)
    assert list(tmp_path.iterdir()) == []
    assert rig.board.list("SpeechSynthInterface") == []


def fake_program(folder: Path, monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Put a program espeak-ng into the path; ``$4`` is the file to write."""
    program = folder / "espeak-ng"
    code = folder / "espeak.py"
    code.write_text(f"import sys, wave\n{script}")
    program.write_text(f"#!/bin/sh\nexec '{sys.executable}' '{code}' \"$@\"\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")


GOOD = """
with wave.open(sys.argv[4], "wb") as file:
    file.setnchannels(1); file.setsampwidth(2); file.setframerate(1000)
    file.writeframes(b"ab" * 500)
"""


def test_a_voice_that_makes_something_else_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    fake_program(tmp_path, monkeypatch, "open(sys.argv[4], 'w').write('FORM of another kind')")
    with pytest.raises(SkillerError, match="makes no wav files"):
        FileVoice(Rig().clock, tmp_path / "run.wav")


def test_a_voice_that_fails_later_is_told_and_the_run_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    bad = "if 'bad' in sys.stdin.read(): sys.exit('the voice has a cold')\n"
    fake_program(tmp_path, monkeypatch, bad + GOOD)
    rig = Rig()
    speech = rig.add(make_speech(rig.board, rig.clock, rig.bus, speech=str(tmp_path / "run.wav")))
    say(rig, "bad", "good")
    speech.close()
    (text,) = rig.logged(Level.ERROR)
    assert text.startswith("cannot say 'bad': speech is not possible here: the voice has a cold")
    assert rig.writes("text", "final", "duration", uid=UID)[-1] == ("good", True, 0.5)


@pytest.mark.parametrize("target", ["missing/run.wav", "file/texts/"])
def test_a_target_that_cannot_be_written_is_one_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, target: str
):
    fake_program(tmp_path, monkeypatch, GOOD)
    (tmp_path / "file").write_text("")
    rig: Any = Rig()
    with pytest.raises(SkillerError, match="speech cannot be written"):
        make_speech(rig.board, rig.clock, rig.bus, speech=f"{tmp_path}/{target}")


def test_a_slip_in_a_word_makes_no_folder(tmp_path: Path):
    assert [
        is_speech_target(text) for text in ("on", "off", "onn", "a.wav", "A.WAV", "new/", str(tmp_path))
    ] == [
        False,
        False,
        False,
        True,
        True,
        True,
        True,
    ]
    with pytest.raises(CxbridgeError, match="--speech cannot be 'onn'") as caught:
        RunOptions(scenario=tmp_path, speech="onn").check()
    assert "FILE.wav" in str(caught.value)
