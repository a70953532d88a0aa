"""Speech in sound files, for machines without a speaker and for recordings of a run."""

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
# in a child process: voice libraries cannot be unloaded, and some print
_PYTTSX3 = """
import sys, pyttsx3
engine = pyttsx3.init()
engine.save_to_file(sys.stdin.read(), sys.argv[1])
engine.runAndWait()
"""


def synthesise(text: str, file: Path) -> None:
    """Speak a text into a new wav file, with the program espeak-ng or else pyttsx3.

    A text without speakable characters may leave no file.

    :raises SkillerError: if no voice is installed; the hint names a package.
    """
    program = next((found for name in _PROGRAMS if (found := shutil.which(name))), None)
    command: Sequence[str] = (
        [program, "-b", "1", "-w", str(file), "--stdin"]
        if program
        else python_command("-c", _PYTTSX3, str(file))
    )
    try:
        # standard input, because the text may look like an option
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
    """Speaks into one wav file, or into a folder with one file per text.

    A text takes the duration of its sound by the run's clock.

    :param target: ``NAME.wav``, which is overwritten, or a folder for ``001-hello.wav`` and so on, created if
        missing.
    :raises SkillerError: if no voice is installed or the target cannot be written.
    """

    def __init__(self, clock: Clock, target: Path) -> None:
        self._clock = clock
        self._target = target
        self._count = 0
        self._end_us = 0
        self._file: IO[bytes] | None = None
        self._sound: wave.Wave_write | None = None
        if not self._speak(_PROBE)[1]:  # raises now if no voice is installed
            raise SkillerError("speech is not possible here: the voice makes no sound", hint=INSTALL_VOICE)
        try:
            if is_sound_file(target):
                self._file = target.open("wb")
            else:
                target.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SkillerError(f"speech cannot be written: {error.strerror}", file=target) from None

    def start(self, text: str) -> float:
        """Write the sound of a text; return its duration."""
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
            # updates the header, so that the file is always valid
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
                    # the header of a stream does not have the length: count the frames
                    return sound.getparams()._replace(nframes=0), sound.readframes(sound.getnframes())
            except (wave.Error, EOFError) as error:
                raise SkillerError(
                    f"the voice here makes no wav files: {error}", hint="install espeak-ng"
                ) from None

    def is_done(self) -> bool:
        """Return whether the duration of the last text has passed."""
        return self._clock.now_us() >= self._end_us

    def close(self) -> None:
        try:
            if self._sound is not None:
                self._sound.close()
        finally:
            if self._file is not None:
                self._file.close()


def is_sound_file(target: Path) -> bool:
    """Return whether the target is a single wav file."""
    return target.suffix.lower() == ".wav"
