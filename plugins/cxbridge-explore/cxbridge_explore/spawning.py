"""Processes of multiprocessing without the working directory on their path, as its files may be untrusted."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.context import SpawnContext
from typing import Final

_SAFE_PATH: Final = "PYTHONSAFEPATH"


@contextmanager
def safe_spawn_context() -> Iterator[SpawnContext]:
    """Yield a context of multiprocessing whose processes lack the working directory on their path.

    The setting applies to processes that start before the context is left.
    """
    setting = os.environ.get(_SAFE_PATH)
    # by the environment, because multiprocessing passes no option -P
    os.environ[_SAFE_PATH] = "1"
    try:
        yield multiprocessing.get_context("spawn")
    finally:
        _restore_setting(setting)


@contextmanager
def safe_process_pool(process_count: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of processes without the working directory on their path.

    The child processes of the pool's processes have the user's path again.
    """
    setting = os.environ.get(_SAFE_PATH)
    with (
        safe_spawn_context() as context,
        ProcessPoolExecutor(process_count, context, _restore_setting, (setting,)) as pool,
    ):
        yield pool


def _restore_setting(setting: str | None) -> None:
    """Restore the user's value of the environment variable; None if it was not set."""
    os.environ.pop(_SAFE_PATH, None)
    if setting is not None:
        os.environ[_SAFE_PATH] = setting
