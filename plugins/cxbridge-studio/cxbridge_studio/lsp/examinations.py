"""Runs examinations of the agent, each in a child process, one after another."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Any, Final

import msgspec

from cxbridge.spawning import python_command
from cxbridge_studio.lsp.knowledge import AgentKnowledge

_MAX_ERROR_LENGTH: Final = 300  # characters that an error shows from the end of a crashed process's output


class Examinations:
    """Runs the requested examinations.

    :param get_options: returns the options of a run as JSON values; called when an examination begins.
    :param on_result: receives the result of each examination.
    """

    def __init__(
        self, get_options: Callable[[], Mapping[str, Any]], on_result: Callable[[AgentKnowledge], None]
    ) -> None:
        self._get_options = get_options
        self._on_result = on_result
        self._task: asyncio.Task[None] | None = None
        self._process: asyncio.subprocess.Process | None = None
        self._is_requested = False

    def request(self) -> None:
        """Begin an examination; during an examination, request a further one, since files have changed."""
        self._is_requested = True
        if self._task is None or self._task.done():
            self._task = asyncio.get_running_loop().create_task(self._run_requested())

    async def _run_requested(self) -> None:
        while self._is_requested:
            self._is_requested = False
            self._on_result(await self._run_child_process())

    async def _run_child_process(self) -> AgentKnowledge:
        """Return the result of the child process, or the error of a crash."""
        self._process = process = await asyncio.create_subprocess_exec(
            *python_command("-m", "cxbridge_studio.lsp.examination_process"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        output, errors = await process.communicate(msgspec.json.encode(self._get_options()))
        try:
            return msgspec.json.decode(output, type=AgentKnowledge)
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
