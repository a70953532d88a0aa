"""Speech synthesis: the writer of SpeechSynthInterface that skills order speech from.

Writes what Fawkes' flite plugin writes: on each order the text, its id, ``final`` false and the duration;
when it is spoken, ``final`` true. Orders wait for each other. The voice is exchangeable: the default one is
silent and takes as long as the text would, by the run's clock.
"""

from __future__ import annotations

import queue
import shutil
import sys
import threading
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import SkillerError
from cxbridge.events import EventBus

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard

_PATIENCE = 10
_LINUX_PLAYER = "aplay"
_SECONDS_PER_TEXT = 0.343
_SECONDS_PER_CHARACTER = 0.070
LOADED_TEXT = "Speech synth loaded"
"""What flite says when it is loaded."""

INSTALL_VOICE = (
    "install a voice, for example with 'apt install espeak-ng', or run with --speech off, the default"
)
"""What to do when there is none."""


def estimate_duration(text: str) -> float:
    """Return about how many seconds it takes to say ``text``.

    A straight line through what flite's voice ``cmu_us_kal`` took for the texts of the recorded runs, 8 to 19
    characters long: within 0.13 s of each.
    """
    return _SECONDS_PER_TEXT + _SECONDS_PER_CHARACTER * len(text)


class Voice(ABC):
    """Says one text after the other."""

    @abstractmethod
    def start(self, text: str) -> float:
        """Begin to say ``text`` and return its duration in seconds, if known."""

    @abstractmethod
    def is_done(self) -> bool:
        """Whether the last text has been said."""

    def trouble(self) -> str:
        """Return why the last text could not be said; empty when it could."""
        return ""

    def close(self) -> None:
        """Be silent."""
        return


class SilentVoice(Voice):
    """Says nothing, for as long as it would take.

    :param clock: the run's clock.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._end_us = 0

    def start(self, text: str) -> float:
        """Return the estimated duration, which starts now."""
        duration = estimate_duration(text)
        self._end_us = self._clock.now_us() + round(duration * MICROSECONDS)
        return duration

    def is_done(self) -> bool:
        """Whether the duration has passed."""
        return self._clock.now_us() >= self._end_us


class SpeakerVoice(Voice):
    """Speaks aloud through :mod:`pyttsx3`, in a thread.

    :raises SkillerError: when no voice is installed, or nothing that plays; it says what to install.
    """

    def __init__(self) -> None:
        if sys.platform == "linux" and shutil.which(_LINUX_PLAYER) is None:
            # pyttsx3 would be silent, and say nothing of it
            raise SkillerError(
                f"speech is not possible here: the program '{_LINUX_PLAYER}' is missing, which plays it",
                hint="install it, for example with 'apt install alsa-utils', "
                "or speak into a file: --speech FILE.wav",
            )
        self._trouble = ""
        self._texts: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._done = threading.Event()
        self._done.set()
        started: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._speak, args=(started,), name="Speech", daemon=True)
        self._thread.start()
        problem = started.get()
        if problem is not None:
            raise SkillerError(f"speech is not possible here: {problem}", hint=INSTALL_VOICE)

    def _speak(self, started: queue.SimpleQueue[str | None]) -> None:
        # A missing voice shows as one of many exceptions, which depend on the platform.
        try:
            import pyttsx3  # noqa: PLC0415 - slow to import, and seldom needed

            spoken = threading.Event()
            engine = pyttsx3.init()
            engine.connect("finished-utterance", lambda **_details: spoken.set())
        except Exception as error:  # noqa: BLE001
            reason = str(error).strip().partition("\n")[0]
            started.put(reason or type(error).__name__)
            return
        started.put(None)
        while (text := self._texts.get()) is not None:
            spoken.clear()
            try:
                engine.say(text)
                engine.runAndWait()
                # With espeak it does not wait: another thread makes and plays the sound.
                if text.strip():
                    spoken.wait(_PATIENCE * (1 + estimate_duration(text)))
            except Exception as error:  # noqa: BLE001 - as above; what comes next may work
                self._trouble = str(error) or type(error).__name__
            finally:
                self._done.set()

    def start(self, text: str) -> float:
        """Hand the text to the speaker; the duration is the estimate."""
        self._done.clear()
        self._trouble = ""
        self._texts.put(text)
        return estimate_duration(text)

    def is_done(self) -> bool:
        """Whether the speaker has said the last text."""
        return self._done.is_set()

    def trouble(self) -> str:
        """Return why the last text could not be said."""
        return self._trouble

    def close(self) -> None:
        """End the thread after the text that is being said."""
        self._texts.put(None)


class SpeechSynthWriter:
    """Writes ``SpeechSynthInterface::NAME`` and speaks the texts that it receives.

    :param voice: None: a :class:`SilentVoice`.
    :param name: the interface's id.
    :param greeting: a text to say first, as flite does with :data:`LOADED_TEXT`; None: none.
    :raises BlackBoardError: when the interface has another writer.
    """

    def __init__(
        self,
        board: BlackBoard,
        clock: Clock,
        bus: EventBus,
        *,
        voice: Voice | None = None,
        name: str = "Flite",
        greeting: str | None = None,
    ) -> None:
        self._board = board
        self._voice = voice or SilentVoice(clock)
        self._log = bus.logger("SpeechSynth")
        # The fields of the interface come from its XML definition: there is no static type for them here.
        self._interface: Any = board.open_for_writing("SpeechSynthInterface", name, owner="SpeechSynth")
        self._speaking = False
        if greeting is not None:
            self._start(greeting)

    @property
    def speaking(self) -> bool:
        """Whether a text is being said or waits for it."""
        return self._speaking or not self._interface.msgq_empty()

    def loop(self) -> None:
        """End the text that is over, begin the next one; to be called once a main loop."""
        if self._speaking and self._voice.is_done():
            self._speaking = False
            self._log_trouble(self._voice.trouble())
            self._interface.final = True
            self._interface.write()
        if self._interface.msgq_empty():
            return
        while not self._speaking and (message := self._interface.msgq_first()) is not None:
            if message.type == "SayMessage":
                self._interface.msgid = message.id
                self._start(message.text)
            self._interface.msgq_pop()

    def _start(self, text: str) -> None:
        self._speaking = True
        self._interface.text = text
        self._interface.final = False
        try:
            self._interface.duration = self._voice.start(text)
        except SkillerError as error:
            # skills that wait for the text continue; the text is over in the next loop
            self._log_trouble(str(error))
            self._interface.duration = 0.0
        self._interface.write()

    def _log_trouble(self, trouble: str) -> None:
        if trouble:
            self._log.error(f"cannot say '{self._interface.text}': {trouble}")

    def close(self) -> None:
        """Be silent and close the interface."""
        self._voice.close()
        self._board.close(self._interface)
