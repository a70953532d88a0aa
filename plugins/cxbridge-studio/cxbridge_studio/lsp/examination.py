"""Examines the agent in a child process, one at a time, and again when a file was saved in between."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from cxbridge.process.python import python_command
from cxbridge_studio.lsp.knowledge import AgentKnowledge, decode

_LAST_WORDS = 300


class Examinations:
    """Examines on demand.

    :param options: gives the options, as JSON has them, when an examination begins.
    :param done: gets the result.
    """

    def __init__(
        self, options: Callable[[], Mapping[str, Any]], done: Callable[[AgentKnowledge], None]
    ) -> None:
        self._options = options
        self._done = done
        self._task: asyncio.Task[None] | None = None
        self._process: asyncio.subprocess.Process | None = None
        self._again = False

    def request(self) -> None:
        """Begin an examination; when there is one already, another one follows it."""
        if self._task is not None and not self._task.done():
            self._again = True
            return
        self._task = asyncio.get_running_loop().create_task(self._run())

    async def _run(self) -> None:
        self._again = True
        while self._again:
            self._again = False
            self._done(await self._examine())

    async def _examine(self) -> AgentKnowledge:
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
            words = errors.decode("utf-8", "replace").strip()[-_LAST_WORDS:]
            return AgentKnowledge(error=f"the check ended with status {process.returncode}: {words}")

    async def close(self) -> None:
        """End the running examination."""
        if self._task is not None:
            self._task.cancel()
        if self._process is not None and self._process.returncode is None:
            self._process.kill()
            await self._process.wait()
