"""Starts processes of multiprocessing without the working directory in `sys.path`.

A file in the working directory could replace an imported module.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess
from typing import Final

_SAFE_PATH_VARIABLE: Final = "PYTHONSAFEPATH"


@contextmanager
def safe_spawn_context() -> Iterator[SpawnContext]:
    """Yield a context of multiprocessing whose processes lack the working directory on their path.

    The setting applies to processes that start before the context is left.
    """
    user_setting = os.environ.get(_SAFE_PATH_VARIABLE)
    # by the environment, because multiprocessing passes the option -P only if this process has it
    os.environ[_SAFE_PATH_VARIABLE] = "1"
    try:
        yield multiprocessing.get_context("spawn")
    finally:
        _restore_setting(user_setting)


def start_safe_process(target: Callable[..., None], *arguments: object) -> BaseProcess:
    """Start a process without the working directory on its path.

    The calling process ends the new process when it exits, unless it is killed. The child processes of the
    new process have the user's path again.
    """
    user_setting = os.environ.get(_SAFE_PATH_VARIABLE)
    with safe_spawn_context() as context:
        process = context.Process(target=_run_target, args=(user_setting, target, arguments), daemon=True)
        process.start()
    return process


def _run_target(user_setting: str | None, target: Callable[..., None], arguments: tuple[object, ...]) -> None:
    _restore_setting(user_setting)
    target(*arguments)


@contextmanager
def safe_process_pool(process_count: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of processes without the working directory on their path.

    The child processes of the pool's processes have the user's path again.
    """
    user_setting = os.environ.get(_SAFE_PATH_VARIABLE)
    with (
        safe_spawn_context() as context,
        ProcessPoolExecutor(process_count, context, _restore_setting, (user_setting,)) as pool,
    ):
        yield pool


def describe_exit(status: int | None) -> str:
    """Return the end of a process as text.

    :param status: the exit status, or the negative number of the signal that has ended the process. None is
        the status of a running process.
    """
    return f"signal {-status}" if status is not None and status < 0 else f"exit status {status}"


def _restore_setting(user_setting: str | None) -> None:
    """Restore the user's value of the environment variable; None for an unset variable."""
    os.environ.pop(_SAFE_PATH_VARIABLE, None)
    if user_setting is not None:
        os.environ[_SAFE_PATH_VARIABLE] = user_setting
