"""The owner's side of a planner process.

The process has its own session, so that its children end with it, and its own folder for temporary files.
The owner removes the folder after the end of the process; if the owner ends first, the process removes its
folder.
"""

from __future__ import annotations

import os
import pickle
import shutil
import signal
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Final

from cxbridge.spawning import python_command
from cxbridge_planning.planner import PlanResult, PlanStatus
from cxbridge_planning.service.jobs import FOLDER_PREFIX, Job

_MAX_OUTPUT_BYTES: Final = 500  # the limit of the planner's output in an error


class PlannerProcess:
    """A process that runs :mod:`.worker`.

    :meth:`close` kills the process with its children and removes its temporary files.
    """

    def __init__(self) -> None:
        self.is_killed = False
        """Whether the owner has killed the process."""
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 - closed together with the process
        self.folder = Path(tempfile.mkdtemp(prefix=FOLDER_PREFIX))
        """The folder of the planner's temporary files."""
        folder_variables = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(self.folder))
        self._process = subprocess.Popen(  # noqa: S603 - our own module, without a shell
            python_command("-m", "cxbridge_planning.service.worker"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._output,
            start_new_session=True,
            # planners iterate over sets of texts: a fixed hash seed makes their plans reproducible
            env={**os.environ, "PYTHONHASHSEED": "0", **folder_variables},
        )

    @property
    def is_alive(self) -> bool:
        """Whether the process can take another job."""
        # poll() reports a killed process as alive for a moment
        return not self.is_killed and self._process.poll() is None

    def run(self, job: Job) -> PlanResult:
        """Run a job, wait for its result and return it; after a crash, the result is FAILED."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            pickle.dump(job, self._process.stdin)
            self._process.stdin.flush()
            result = pickle.load(self._process.stdout)  # noqa: S301 - written by our own process
        # the process has ended, or its result is cut or no pickle
        except (EOFError, OSError, ValueError, pickle.UnpicklingError):
            return PlanResult(
                PlanStatus.FAILED, job.planner.name, message=self._describe_crash(job.planner.name)
            )
        assert isinstance(result, PlanResult)
        return result

    def _describe_crash(self, planner: str) -> str:
        """Return how the process ended, with the end of its output."""
        status = self._process.wait()
        end_text = (
            f"was killed by {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
        )
        self._output.seek(0, os.SEEK_END)
        self._output.seek(max(0, self._output.tell() - _MAX_OUTPUT_BYTES))
        output = self._output.read().decode(errors="replace").strip()
        return f"the process of planner {planner} {end_text}" + (
            f"; its last output: {output}" if output else ""
        )

    def kill(self) -> None:
        """Kill the process and its children."""
        self.is_killed = True
        if not (hasattr(os, "killpg") and hasattr(signal, "SIGKILL")):
            self._process.kill()  # Windows has no killpg(); a planner's children end by themselves
            return
        with suppress(ProcessLookupError):  # the process group may have ended
            os.killpg(self._process.pid, signal.SIGKILL)

    def close(self) -> None:
        """Kill the process and release its resources."""
        self.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout, self._output):
            if stream is not None:
                with suppress(OSError):  # closing flushes, which fails if the planner has ended
                    stream.close()
        shutil.rmtree(self.folder, ignore_errors=True)
