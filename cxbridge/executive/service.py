"""Environments beside the executive's, for whoever asks a running daemon; see docs/debugging.md."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.errors import ClipsError
from cxbridge.events import Level
from cxbridge.executive.agenda import agenda_size
from cxbridge.executive.evaluating import Evaluation, evaluate
from cxbridge.executive.factediting import count_facts
from cxbridge.executive.loading import is_readable_file
from cxbridge.executive.values import FALSE

if TYPE_CHECKING:
    from cxbridge.executive.environment import ClipsEnvironment
    from cxbridge.executive.manager import EnvironmentManager
    from cxbridge.executive.output import LineSink

WATCH_ITEMS: Final = ("facts", "rules", "all")
"""What can be watched."""

_NAME = re.compile(r"[A-Za-z0-9_.-]{1,64}")
_ORDER: Final = tuple(Level)


@dataclass(frozen=True, slots=True)
class EnvironmentInfo:
    """What there is to tell of an environment.

    :param own: whether it was created by :class:`EnvironmentService`.
    :param facts: how many there are.
    :param agenda: how many activations.
    :param features: those that it has, sorted.
    :param watch: what of ``facts`` and ``rules`` is watched, in part at least.
    :param log_level: the least level at which it logs.
    :param ended: whether no rule fires any more.
    """

    name: str
    own: bool
    facts: int
    agenda: int
    features: tuple[str, ...]
    watch: tuple[str, ...]
    log_level: str
    ended: bool


class EnvironmentService:
    """Creates and destroys environments of a running executive, and sets them up.

    Only its own can be destroyed. Their rules run when :meth:`run` is called.

    :param manager: that of the executive.
    """

    def __init__(self, manager: EnvironmentManager) -> None:
        self._manager = manager
        self._own: list[str] = []
        self._levels: dict[str, Level] = {}
        self._sinks: dict[str, LineSink] = {}

    def find(self, name: str) -> ClipsEnvironment:
        """Return an environment.

        :raises ClipsError: when there is none of that name.
        """
        found = self._manager.environments.get(name)
        if found is None:
            known = ", ".join(self._manager.environments)
            raise ClipsError(f"there is no CLIPS environment '{name}'", hint=f"there are: {known}")
        return found

    @property
    def names(self) -> Sequence[str]:
        """The names of the environments, in the order in which they were created."""
        return tuple(self._manager.environments)

    def list(self) -> Sequence[EnvironmentInfo]:
        """Return what there is to tell of each, in the order in which they were created."""
        return [self.info(name) for name in self._manager.environments]

    def info(self, name: str) -> EnvironmentInfo:
        """Return what there is to tell of an environment.

        :raises ClipsError: when there is none of that name.
        """
        env = self.find(name)
        with env.lock:
            watch = [item for item, on in (("facts", env.watcher.facts), ("rules", env.watcher.rules)) if on]
            return EnvironmentInfo(
                name=name,
                own=name in self._own,
                facts=count_facts(env),
                agenda=agenda_size(env),
                features=self._manager.loaded_features(name),
                watch=tuple(watch),
                log_level=self._levels.get(name, Level.DEBUG).name.lower(),
                ended=env.is_ended,
            )

    def create(self, name: str) -> ClipsEnvironment:
        """Create an environment with the library (utils, time, path) and the features to request.

        :raises ClipsError: when there is one of that name, or it is more than letters, digits and ``_.-``.
        """
        if not _NAME.fullmatch(name):
            raise ClipsError(
                f"'{name}' cannot name an environment", hint="use up to 64 letters, digits, _, . and -"
            )
        made = self._manager.create(name)
        self._own.append(name)
        return made

    def destroy(self, name: str) -> None:
        """Destroy an environment that was created here.

        :raises ClipsError: when there is none.
        """
        self.find(name)
        if name not in self._own:
            raise ClipsError(f"the environment '{name}' is not to be destroyed", hint="it is the executive's")
        self._own.remove(name)
        self._levels.pop(name, None)
        self._sinks.pop(name, None)
        self._manager.destroy(name)

    def load(self, name: str, file: Path, *, batch: bool = False) -> Sequence[str]:
        """Load a file's constructs, or with ``batch`` execute its commands; return what is wrong with it.

        :raises ClipsError: when there is no such environment, or the file cannot be read.
        """
        env = self.find(name)
        if not is_readable_file(str(file)):
            raise ClipsError("CLIPS cannot read this file", file=file)
        with env.lock:
            before = len(env.loader.diagnostics)
            (env.batch if batch else env.load)(file)
            env.api.clear_halt()  # or what is wrong in it would end the next run
            return [str(item) for item in env.loader.diagnostics[before:]]

    def request_feature(self, name: str, feature: str) -> None:
        """Give an environment a feature; no error when it has it.

        :raises ClipsError: when there is no such environment or feature.
        """
        env = self.find(name)
        if feature in self._manager.loaded_features(name):
            return
        with env.lock:
            if self._manager.request(name, feature) == FALSE:
                known = ", ".join(self._manager.features)
                raise ClipsError(f"there is no CLIPS feature '{feature}'", hint=f"there are: {known}")

    def evaluate(self, name: str, expression: str) -> Evaluation:
        """Evaluate an expression of CLIPS; it has :data:`~cxbridge.executive.evaluating.LIMIT_S` for it.

        :raises ClipsError: when there is no such environment, or it does not parse, fails or takes too long.
        """
        env = self.find(name)
        with env.lock:
            return evaluate(env, expression)

    def watch(self, name: str, item: str, names: Sequence[str] = (), *, on: bool = True) -> None:
        """Do what ``(watch ITEM NAME...)`` and ``(unwatch ...)`` do.

        :raises ClipsError: when there is no such environment, item or name.
        """
        env = self.find(name)
        with env.lock:
            env.watch(item, names, on=on)

    def set_log_level(self, name: str, level: str) -> None:
        """Let an environment log only lines of this level and above.

        :param level: ``debug``, ``info``, ``warn`` or ``error``.
        :raises ClipsError: when there is no such environment or level.
        """
        env = self.find(name)
        found = next((item for item in Level if item.name.lower() == level), None)
        if found is None:
            known = ", ".join(item.name.lower() for item in Level)
            raise ClipsError(f"there is no log level '{level}'", hint=f"use one of: {known}")
        with env.lock:
            self._levels[name] = found
            if name not in self._sinks:
                self._sinks[name] = env.output.redirect(lambda at, text: self._log(name, at, text))

    def _log(self, name: str, level: Level, text: str) -> None:
        if _ORDER.index(level) >= _ORDER.index(self._levels[name]):
            self._sinks[name](level, text)

    def run(self) -> None:
        """Run the rules of those that were created here, in the order in which they were."""
        for name in self._own:
            env = self._manager.environments[name]
            with env.lock:
                self._manager.before_run(name)
                env.refresh_agenda()
                env.run()
