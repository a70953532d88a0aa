"""A thread that runs an asyncio event loop, for servers of plug-ins."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from typing import Any, Final, TypeVar

from cxbridge.closing import Closing

ResultT = TypeVar("ResultT")

# a callback that does not return must not block the end of the process, so the thread is a daemon, too
_STOP_TIMEOUT_S: Final = 5.0


class LoopThread(Closing):
    """A thread that runs an event loop until it is closed.

    All methods may be called from any thread, even before the loop runs; only `close`, which joins the
    thread, must not be called within it. The loop starts calls and coroutines in order; `close` ends the loop
    after the earlier calls.
    """

    def __init__(self, name: str) -> None:
        # with a factory, the runner does not make the loop the present event loop of the calling thread
        self._runner = asyncio.Runner(loop_factory=asyncio.new_event_loop)
        self._loop = self._runner.get_loop()
        self._close_requested = asyncio.Event()
        self._thread = threading.Thread(target=self._run_loop, name=name, daemon=True)
        try:
            self._thread.start()
        except RuntimeError:  # the machine has no thread left
            self._runner.close()
            raise

    def call(self, function: Callable[..., object], *arguments: object) -> bool:
        """Call a function in the loop; return False if the loop is closed."""
        try:
            self._loop.call_soon_threadsafe(function, *arguments)
        except RuntimeError:
            return False
        return True

    def spawn(self, coroutine: Coroutine[Any, Any, ResultT]) -> Future[ResultT]:
        """Run a coroutine in the loop.

        :raises RuntimeError: if the loop is closed.
        """
        try:
            return asyncio.run_coroutine_threadsafe(coroutine, self._loop)
        except RuntimeError:
            coroutine.close()
            raise

    def close(self) -> None:
        """Cancel the coroutines, close the loop and join the thread; further calls do nothing."""
        if self.call(self._close_requested.set):
            self._thread.join(_STOP_TIMEOUT_S)

    def _run_loop(self) -> None:
        with self._runner:
            self._runner.run(self._run_until_closed())

    async def _run_until_closed(self) -> None:
        await self._close_requested.wait()
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await asyncio.sleep(0)  # closed transports release their sockets in the next cycle of the loop
