"""Speech synthesis: the writer of SpeechSynthInterface.

The values are those of Fawkes' flite plugin: for each SayMessage its text, its id, ``final`` false and the
duration; at the end of the text ``final`` true. A message waits until the text before it ends. The default
voice is silent and takes the estimated duration by the run's clock.
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

# The limit of a text, as a multiple of its estimated duration and another second (chosen freely): some
# drivers do not report the end of a text.
_MAX_DURATION_FACTOR = 10
_LINUX_PLAYER = "aplay"
_SECONDS_PER_TEXT = 0.343
_SECONDS_PER_CHARACTER = 0.070

LOADED_TEXT = "Speech synth loaded"
"""The text that flite says after loading."""

INSTALL_VOICE = (
    "install a voice, for example with 'apt install espeak-ng', or run with --speech off, the default"
)
"""The remedy for a missing voice."""


def estimate_duration(text: str) -> float:
    """Return the approximate duration of a spoken text in seconds."""
    # a linear fit to flite's voice cmu_us_kal in the recorded runs (texts of 8 to 19 characters), which
    # differs from each by at most 0.13 s
    return _SECONDS_PER_TEXT + _SECONDS_PER_CHARACTER * len(text)


class Voice(ABC):
    """Says texts one by one."""

    @abstractmethod
    def start(self, text: str) -> float:
        """Start saying a text; return its duration in seconds."""

    @abstractmethod
    def is_done(self) -> bool:
        """Return whether the last text is finished."""

    def failure(self) -> str:
        """Return why the last text failed; empty without a failure."""
        return ""

    def close(self) -> None:  # noqa: B027 - optional
        """Stop speaking."""


class SilentVoice(Voice):
    """Says nothing for as long as the text would take."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._end_us = 0

    def start(self, text: str) -> float:
        duration_s = estimate_duration(text)
        self._end_us = self._clock.now_us() + round(duration_s * MICROSECONDS)
        return duration_s

    def is_done(self) -> bool:
        return self._clock.now_us() >= self._end_us


class SpeakerVoice(Voice):
    """Speaks through :mod:`pyttsx3` in a thread.

    :raises SkillerError: if no voice or player is installed; the hint names the package.
    """

    def __init__(self) -> None:
        if sys.platform == "linux" and shutil.which(_LINUX_PLAYER) is None:
            # pyttsx3 would be silent without an error
            raise SkillerError(
                f"speech is not available: the player '{_LINUX_PLAYER}' is missing",
                hint="install the player, for example with 'apt install alsa-utils'",
            )
        self._failure = ""
        self._texts: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._done_event = threading.Event()
        self._done_event.set()
        start_result: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._speak, args=(start_result,), name="Speech", daemon=True)
        self._thread.start()
        problem = start_result.get()
        if problem is not None:
            raise SkillerError(f"speech is not available: {problem}", hint=INSTALL_VOICE)

    def _speak(self, start_result: queue.SimpleQueue[str | None]) -> None:
        # a missing voice raises one of many exceptions, depending on the platform
        try:
            import pyttsx3  # noqa: PLC0415 - slow to import, and seldom needed

            spoken_event = threading.Event()
            engine = pyttsx3.init()
            engine.connect("finished-utterance", lambda **_details: spoken_event.set())
        except Exception as error:  # noqa: BLE001
            reason = str(error).strip().partition("\n")[0]
            start_result.put(reason or type(error).__name__)
            return
        start_result.put(None)
        while (text := self._texts.get()) is not None:
            spoken_event.clear()
            try:
                engine.say(text)
                engine.runAndWait()
                # espeak returns before its own thread has played the sound; a blank text has no sound
                if text.strip():
                    spoken_event.wait(_MAX_DURATION_FACTOR * (1 + estimate_duration(text)))
            except Exception as error:  # noqa: BLE001 - as above; the next text may succeed
                self._failure = str(error) or type(error).__name__
            finally:
                self._done_event.set()

    def start(self, text: str) -> float:
        """Queue a text for the speaker; return its estimated duration."""
        self._done_event.clear()
        self._failure = ""
        self._texts.put(text)
        return estimate_duration(text)

    def is_done(self) -> bool:
        return self._done_event.is_set()

    def failure(self) -> str:
        return self._failure

    def close(self) -> None:
        """End the thread after the current text."""
        self._texts.put(None)


class SpeechSynthWriter:
    """Writes ``SpeechSynthInterface::NAME`` and says the received texts.

    :param voice: None: a :class:`SilentVoice`.
    :param name: the id of the interface.
    :param greeting: a text to say at once, such as flite's :data:`LOADED_TEXT`; None: no greeting.
    :raises BlackBoardError: if the interface has another writer.
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
        # the class of the interface is made from XML at run time, so it has no static type
        self._interface: Any = board.open_for_writing("SpeechSynthInterface", name, owner="SpeechSynth")
        self._is_speaking = False
        if greeting is not None:
            self._start_text(greeting)

    def loop(self) -> None:
        """End the finished text and start the next text. The main loop calls this method once per loop."""
        if self._is_speaking and self._voice.is_done():
            self._is_speaking = False
            if failure := self._voice.failure():
                self._log.error(f"cannot say '{self._interface.text}': {failure}")
            self._interface.final = True
            self._interface.write()
        if self._interface.msgq_empty():
            return
        while not self._is_speaking and (message := self._interface.msgq_first()) is not None:
            if message.type == "SayMessage":
                self._interface.msgid = message.id
                self._start_text(message.text)
            self._interface.msgq_pop()

    def _start_text(self, text: str) -> None:
        self._is_speaking = True
        self._interface.text = text
        self._interface.final = False
        self._interface.duration = self._voice.start(text)
        self._interface.write()

    def close(self) -> None:
        """Stop speaking and close the interface."""
        self._voice.close()
        self._board.close(self._interface)
