"""Speech into sound files, for machines without a speaker and for records of a run."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
import wave
from collections.abc import Sequence
from pathlib import Path
from typing import IO

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import SkillerError
from cxbridge.process.python import python_command
from cxbridge.skiller.speech import INSTALL_VOICE, Voice

_PROGRAMS = ("espeak-ng", "espeak")
_PROBE = "ok"
_SYNTHESIS_S = 60
_SLUG_LENGTH = 40
_SILENCE = wave._wave_params(1, 2, 22050, 0, "NONE", "not compressed")  # noqa: SLF001 - the type of getparams()
# In a child process: libraries of voices are not made to be unloaded, and some print.
_PYTTSX3 = """
import sys, pyttsx3
engine = pyttsx3.init()
engine.save_to_file(sys.stdin.read(), sys.argv[1])
engine.runAndWait()
"""


def synthesise(text: str, file: Path) -> None:
    """Speak ``text`` into a new wav file, by espeak-ng's program, or else by pyttsx3.

    A text without anything to say may leave no file.

    :raises SkillerError: when no voice is installed; it says what to install.
    """
    program = next((found for name in _PROGRAMS if (found := shutil.which(name))), None)
    command: Sequence[str] = (
        [program, "-b", "1", "-w", str(file), "--stdin"]
        if program
        else python_command("-c", _PYTTSX3, str(file))
    )
    try:
        # The text goes to the standard input: it may begin like an option.
        done = subprocess.run(  # noqa: S603 - a fixed program
            command,
            input=text.encode("utf-8", "replace"),
            capture_output=True,
            timeout=_SYNTHESIS_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise SkillerError(f"the voice was not done within {_SYNTHESIS_S} s") from None
    if done.returncode:
        reason = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        raise SkillerError(f"speech is not possible here: {reason}", hint=INSTALL_VOICE)


class FileVoice(Voice):
    """Speaks into a wav file, one text after the other, or into a folder, one file a text.

    A text takes as long as its sound, by the run's clock.

    :param target: ``NAME.wav``, overwritten; else a folder for ``001-hello.wav`` and so on, made when it is
        missing.
    :raises SkillerError: when no voice is installed, or the target cannot be written.
    """

    def __init__(self, clock: Clock, target: Path) -> None:
        self._clock = clock
        self._target = target
        self._count = 0
        self._end_us = 0
        self._file: IO[bytes] | None = None
        self._sound: wave.Wave_write | None = None
        if not self._speak(_PROBE)[1]:  # a missing voice shows now
            raise SkillerError("speech is not possible here: the voice makes no sound", hint=INSTALL_VOICE)
        try:
            if is_sound_file(target):
                self._file = target.open("wb")
            else:
                target.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SkillerError(f"speech cannot be written: {error.strerror}", file=target) from None

    def start(self, text: str) -> float:
        """Write the sound of ``text`` and return its duration, which starts now."""
        parameters, frames = self._speak(text)
        try:
            self._write(text, parameters, frames)
        except OSError as error:
            raise SkillerError(f"speech cannot be written: {error.strerror}", file=self._target) from None
        seconds = len(frames) / (parameters.nchannels * parameters.sampwidth * parameters.framerate)
        self._end_us = self._clock.now_us() + round(seconds * MICROSECONDS)
        return seconds

    def _write(self, text: str, parameters: wave._wave_params, frames: bytes) -> None:
        if self._file is not None:
            if self._sound is None:
                self._sound = wave.open(self._file, "wb")  # noqa: SIM115 - closed with the voice
                self._sound.setparams(parameters)
            # Brings the header up to date, so that the file is whole at all times.
            self._sound.writeframes(frames)
            return
        self._count += 1
        slug = "-".join(re.findall(r"[a-z0-9]+", text.lower()))[:_SLUG_LENGTH].rstrip("-")
        name = f"{self._count:03}{'-' if slug else ''}{slug}.wav"
        with wave.open(str(self._target / name), "wb") as sound:
            sound.setparams(parameters)
            sound.writeframes(frames)

    @staticmethod
    def _speak(text: str) -> tuple[wave._wave_params, bytes]:
        """Return the sound of a text."""
        with tempfile.TemporaryDirectory(prefix="cxbridge-") as folder:
            file = Path(folder) / "speech.wav"
            synthesise(text, file)
            if not file.is_file():
                return _SILENCE, b""
            try:
                with wave.open(str(file), "rb") as sound:
                    # The header of a stream does not know its length: count the frames.
                    return sound.getparams()._replace(nframes=0), sound.readframes(sound.getnframes())
            except (wave.Error, EOFError) as error:
                raise SkillerError(
                    f"the voice here makes no wav files: {error}", hint="install espeak-ng"
                ) from None

    def is_done(self) -> bool:
        """Whether the sound of the last text would be over."""
        return self._clock.now_us() >= self._end_us

    def close(self) -> None:
        """Close the file."""
        try:
            if self._sound is not None:
                self._sound.close()
        finally:
            if self._file is not None:
                self._file.close()


def is_sound_file(target: Path) -> bool:
    """Whether speech goes into one file: one whose name ends in ``.wav``."""
    return target.suffix.lower() == ".wav"
