"""Runs examinations of the agent in a child process, one at a time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from cxbridge.spawning import python_command
from cxbridge_studio.lsp.knowledge import AgentKnowledge, decode

_MAX_ERROR_LENGTH = 300  # characters of a crash's output to show, from its end


class Examinations:
    """Runs the requested examinations.

    :param options: returns the options of a run as JSON values; called when an examination begins.
    :param done: gets the result of each examination.
    """

    def __init__(
        self, options: Callable[[], Mapping[str, Any]], done: Callable[[AgentKnowledge], None]
    ) -> None:
        self._options = options
        self._done = done
        self._task: asyncio.Task[None] | None = None
        self._process: asyncio.subprocess.Process | None = None
        self._is_requested_again = False

    def request(self) -> None:
        """Begin an examination. During an examination, another one follows, since the files have changed."""
        if self._task is not None and not self._task.done():
            self._is_requested_again = True
            return
        self._task = asyncio.get_running_loop().create_task(self._run())

    async def _run(self) -> None:
        self._is_requested_again = True
        while self._is_requested_again:
            self._is_requested_again = False
            self._done(await self._examine())

    async def _examine(self) -> AgentKnowledge:
        """Return the result of the child process, or the error of a crash."""
        self._process = process = await asyncio.create_subprocess_exec(
            *python_command("-m", "cxbridge_studio.lsp.examine"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        output, errors = await process.communicate(msgspec.json.encode(self._options()))
        try:
            return decode(output)
        except msgspec.DecodeError:
            error_output = errors.decode("utf-8", "replace").strip()[-_MAX_ERROR_LENGTH:]
            return AgentKnowledge(error=f"the check ended with status {process.returncode}: {error_output}")

    async def close(self) -> None:
        """End the running examination."""
        if self._task is not None:
            self._task.cancel()
        if self._process is not None and self._process.returncode is None:
            self._process.kill()
            await self._process.wait()
