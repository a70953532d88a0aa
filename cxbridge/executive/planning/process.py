"""The owner's side of a planner process."""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Final

from cxbridge.executive.planning.folder import EngineFolder
from cxbridge.executive.planning.jobs import Job, receive, send
from cxbridge.executive.planning.planner import PlanResult, PlanStatus
from cxbridge.spawning import python_command

_WORDS: Final = 500  # bytes of the planner's output in an error


class PlannerProcess:
    """A running :mod:`.worker`. Killing it also kills its children and removes its temporary files."""

    def __init__(self) -> None:
        self._killed = False
        self._noise = tempfile.TemporaryFile()  # noqa: SIM115  closed together with the process
        self._folder = EngineFolder()
        self._process = subprocess.Popen(  # noqa: S603 - ourselves
            python_command("-m", "cxbridge.executive.planning.worker"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._noise,
            start_new_session=True,
            # planners iterate over sets of texts: a fixed hash seed makes their plans reproducible
            env={**os.environ, "PYTHONHASHSEED": "0", **self._folder.environment},
            pass_fds=self._folder.files,
        )

    @property
    def alive(self) -> bool:
        """Whether the process can take another job."""
        # poll() reports a killed process as alive for a moment
        return not self._killed and self._process.poll() is None

    @property
    def folder(self) -> Path:
        """The folder of the planner's temporary files."""
        return self._folder.path

    @property
    def killed(self) -> bool:
        """Whether the owner has killed the process."""
        return self._killed

    def run(self, job: Job) -> PlanResult:
        """Run a job and return its result. A crash is a failed result."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            send(self._process.stdin, job)
            result = receive(self._process.stdout)
        except (EOFError, OSError, ValueError):
            return PlanResult(PlanStatus.FAILED, job.planner.name, message=self._last_words(job.planner.name))
        assert isinstance(result, PlanResult)
        return result

    def _last_words(self, planner: str) -> str:
        status = self._process.wait()
        how = f"was ended by {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
        self._noise.seek(0, os.SEEK_END)
        self._noise.seek(max(0, self._noise.tell() - _WORDS))
        words = self._noise.read().decode(errors="replace").strip()
        return f"the process of planner {planner} {how}" + (f"; it said: {words}" if words else "")

    def kill(self) -> None:
        """Kill the process and its children."""
        self._killed = True
        if not (hasattr(os, "killpg") and hasattr(signal, "SIGKILL")):
            self._process.kill()  # Windows has no process groups; a planner's children end by themselves
            return
        with suppress(ProcessLookupError):  # the process group may have ended
            os.killpg(self._process.pid, signal.SIGKILL)

    def close(self) -> None:
        """Kill the process and release its resources."""
        self.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout, self._noise):
            if stream is not None:
                with suppress(OSError):  # closing flushes, which fails if the planner has ended
                    stream.close()
        self._folder.close()
