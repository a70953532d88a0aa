"""Calls of cxbridge commands as child processes, whose output is the answer of a tool."""

from __future__ import annotations

import os
from subprocess import DEVNULL, PIPE
from typing import Final

import anyio
from anyio.abc import ByteReceiveStream, Process

from cxbridge.errors import CxbridgeError
from cxbridge.spawning import python_command

_CLEANING_UP_S: Final = 5.0  # seconds for a command to clean up before it is killed
_MAX_OUTPUT_BYTES: Final = 1 << 20  # limit of each output stream; further output is read and dropped

# The smallest exit status of a command that has no answer, except for `_TIMED_OUT`.
_BAD_USAGE: Final = 2

_TIMED_OUT: Final = 3  # exit status of a command that has an answer although its time limit has passed


async def call(*arguments: str, patience_s: float) -> tuple[int, str]:
    """Run a command; return its exit status and output.

    Cancelling the call ends the process.

    :param patience_s: the time limit in seconds of real time.
    :raises CxbridgeError: if the command fails, with the error text of the command, or exceeds the limit.
    """
    command = python_command("-m", "cxbridge", *arguments)
    # a client takes colour codes for text
    environment = os.environ | {"NO_COLOR": "1"}
    async with await anyio.open_process(
        command, stdin=DEVNULL, stdout=PIPE, stderr=PIPE, env=environment
    ) as process:
        try:
            with anyio.fail_after(patience_s):
                output, errors = await _outputs(process)
        except TimeoutError:
            raise CxbridgeError(
                f"'cxbridge {arguments[0]}' has not ended after {patience_s:g} s and was stopped",
                hint="ask for less, or for a longer time",
            ) from None
        finally:
            await _end(process)
    status = process.returncode or 0
    if status >= _BAD_USAGE and status != _TIMED_OUT:
        raise CxbridgeError(
            errors.strip().removeprefix("cxbridge: error: ") or output.strip() or f"status {status}"
        )
    return status, output.strip() or errors.strip()


async def _outputs(process: Process) -> tuple[str, str]:
    """Return a process's output on stdout and stderr after its end."""
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


async def _end(process: Process) -> None:
    """End a running process, first with the signal that lets commands clean up."""
    if process.returncode is not None:
        return
    process.terminate()
    # shielded: a cancelled call must still wait for the end of the process
    with anyio.CancelScope(shield=True):
        with anyio.move_on_after(_CLEANING_UP_S):
            await process.wait()
        if process.returncode is None:
            process.kill()
