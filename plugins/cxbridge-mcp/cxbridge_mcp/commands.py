"""Calls of cxbridge commands as child processes, whose output is the answer of a tool."""

from __future__ import annotations

import os
from subprocess import DEVNULL, PIPE
from typing import Final

import anyio
from anyio.abc import ByteReceiveStream, Process

from cxbridge.errors import CxbridgeError
from cxbridge.spawning import python_command

_CLEAN_UP_S: Final = 5.0  # the time for a command to clean up before it is killed
# of each output stream, far above the length of an answer; further output is read and dropped
_MAX_OUTPUT_BYTES: Final = 1 << 20

# A command with this exit status or a higher one has no answer, except for `_TIMEOUT_STATUS`.
_MIN_ERROR_STATUS: Final = 2

# The time limit of a run has passed: the run ended, and has an answer.
_TIMEOUT_STATUS: Final = 3


async def run_command(*arguments: str, timeout_s: float) -> tuple[int, str]:
    """Run a command; return its exit status and its output on stdout, or on stderr if stdout is empty.

    Cancelling the call ends the process.

    :param arguments: the name of the command, and its arguments.
    :param timeout_s: the time limit in real time.
    :raises CxbridgeError: if the command fails, with the error text of the command, or exceeds the limit.
    """
    command = python_command("-m", "cxbridge", *arguments)
    # an assistant takes colour codes for text
    environment = os.environ | {"NO_COLOR": "1"}
    async with await anyio.open_process(
        command, stdin=DEVNULL, stdout=PIPE, stderr=PIPE, env=environment
    ) as process:
        try:
            with anyio.fail_after(timeout_s):
                output, errors = await _read_outputs(process)
        except TimeoutError:
            raise CxbridgeError(
                f"'cxbridge {arguments[0]}' has not ended after {timeout_s:g} s and was stopped",
                hint="request less, or a longer time limit",
            ) from None
        finally:
            await _end_process(process)
    status = process.returncode or 0
    # a negative status is the number of the signal that ended the process
    if not 0 <= status < _MIN_ERROR_STATUS and status != _TIMEOUT_STATUS:
        raise CxbridgeError(
            errors.strip().removeprefix("cxbridge: error: ")
            or output.strip()
            or f"'cxbridge {arguments[0]}' ended with the status {status}"
        )
    return status, output.strip() or errors.strip()


async def _read_outputs(process: Process) -> tuple[str, str]:
    """Wait for the end of a process; return its output on stdout and stderr."""
    buffers = [bytearray(), bytearray()]

    async def read(stream: ByteReceiveStream, buffer: bytearray) -> None:
        async for chunk in stream:
            buffer += chunk[: _MAX_OUTPUT_BYTES - len(buffer)]

    async with anyio.create_task_group() as group:
        for stream, buffer in zip((process.stdout, process.stderr), buffers, strict=True):
            assert stream is not None
            group.start_soon(read, stream, buffer)
        await process.wait()
    output, errors = (bytes(buffer).decode(errors="replace") for buffer in buffers)
    return output, errors


async def _end_process(process: Process) -> None:
    """End a running process: first by the signal at which commands clean up, then by force."""
    if process.returncode is not None:
        return
    process.terminate()
    # shielded: a cancelled call must still wait for the end of the process
    with anyio.CancelScope(shield=True):
        with anyio.move_on_after(_CLEAN_UP_S):
            await process.wait()
        if process.returncode is None:
            process.kill()
