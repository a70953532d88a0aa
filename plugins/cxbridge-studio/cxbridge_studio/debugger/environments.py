"""Manages the CLIPS environments of a running daemon, and their features; see docs/debugging.md.

Clients may create environments besides the executive's, for example to try rules.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from clips._clips import lib
from msgspec import Struct

from cxbridge.errors import ClipsError
from cxbridge.executive.host.capi import items_of
from cxbridge.executive.host.constructs import construct_names
from cxbridge.executive.host.values import FALSE
from cxbridge.file_access import why_unreadable
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.debugger.evaluating import Evaluation, evaluate
from cxbridge_studio.debugger.levels import LevelName, find_level

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.manager import EnvironmentManager

_NAME = re.compile(r"[A-Za-z0-9_.-]{1,64}")


class EnvironmentInfo(Struct, frozen=True):
    """The state of an environment.

    The field names are keys of the answers in JSON.

    :param own: whether a client has created the environment, through :class:`EnvironmentService`; only such
        an environment can be destroyed.
    :param facts: the number of facts.
    :param agenda: the number of activations.
    :param features: the names of the features, sorted.
    :param watch: ``facts`` and ``rules``, each if at least some of them are watched.
    :param log_level: the minimum log level.
    :param ended: whether no rule fires any more.
    """

    name: str
    own: bool
    facts: int
    agenda: int
    features: tuple[str, ...]
    watch: tuple[str, ...]
    log_level: LevelName
    ended: bool


class EnvironmentService:
    """Creates, destroys and configures environments of a running executive.

    Clients can destroy only the environments that the service has created:
    :attr:`EnvironmentManager.client_environments`.

    :param manager: the executive's manager.
    """

    def __init__(self, manager: EnvironmentManager) -> None:
        self._manager = manager

    def list(self) -> Sequence[EnvironmentInfo]:
        """Describe all environments in order of creation."""
        return [self.describe(name) for name in self._manager.environments]

    def describe(self, name: str) -> EnvironmentInfo:
        """Describe an environment.

        :raises ClipsError: if the name is unknown.
        """
        env = self._manager.find(name)
        with env.lock:
            watchers = {"facts": env.watcher.facts, "rules": env.watcher.rules}
            return EnvironmentInfo(
                name=name,
                own=name in self._manager.client_environments,
                facts=sum(1 for _ in items_of(lib.GetNextFact, env.c_env)),
                agenda=sum(1 for _ in items_of(lib.GetNextActivation, env.c_env)),
                features=self._manager.loaded_features(name),
                watch=tuple(item for item, is_watched in watchers.items() if is_watched),
                log_level=env.log_level.name.lower(),
                ended=env.is_ended,
            )

    def create(self, name: str) -> ClipsEnvironment:
        """Create an environment with the CLIPS library (utils, time, path). Its rules may request features.

        :param name: 1 to 64 letters, digits and ``_.-``.
        :raises ClipsError: if the name exists or is invalid, or the library does not load.
        """
        if not _NAME.fullmatch(name):
            raise ClipsError(
                f"'{name}' is not a valid name for an environment",
                hint="use up to 64 letters, digits, _, . and -",
            )
        env = self._manager.create(name)
        self._manager.client_environments.append(name)
        return env

    def destroy(self, name: str) -> None:
        """Destroy an environment created by this service.

        :raises ClipsError: if the environment is unknown, or the executive's.
        """
        self._manager.find(name)
        if name not in self._manager.client_environments:
            raise ClipsError(f"the environment '{name}' cannot be destroyed", hint="it is the executive's")
        self._manager.destroy(name)

    def load(self, name: str, file: Path, *, batch: bool = False) -> Sequence[str]:
        """Load a file's constructs, or with ``batch`` execute its commands; return the mistakes.

        :raises ClipsError: if the environment is unknown or the file unreadable.
        """
        env = self._manager.find(name)
        if reason := why_unreadable(file):
            raise ClipsError(f"CLIPS cannot read this file: it {reason}", file=file)
        with env.lock:
            diagnostic_count = len(env.loader.diagnostics)
            (env.batch if batch else env.load)(file)
            env.api.clear_halt()  # a mistake in the file would end the next firing of rules
            return [str(diagnostic) for diagnostic in env.loader.diagnostics[diagnostic_count:]]

    def request_feature(self, name: str, feature: str) -> None:
        """Load a feature into an environment; do nothing if it has the feature.

        :raises ClipsError: if the environment or feature is unknown.
        """
        env = self._manager.find(name)
        with env.lock:
            if self._manager.request(name, feature) == FALSE:
                hint = f"there are: {', '.join(self._manager.features)}"
                raise ClipsError(f"there is no CLIPS feature '{feature}'", hint=hint)

    def evaluate(self, name: str, expression: str) -> Evaluation:
        """Evaluate an expression within :data:`~cxbridge_studio.debugger.evaluating.LIMIT_S`.

        :raises ClipsError: if the environment is unknown, or the expression does not parse, fails or takes
            too long.
        """
        env = self._manager.find(name)
        with env.lock:
            return evaluate(env, expression)

    def watch(self, name: str, item: str, names: Sequence[str] = (), *, on: bool = True) -> None:
        """Execute ``(watch ITEM NAME...)`` or ``(unwatch ...)``.

        :param item: ``facts``, ``rules`` or ``all``.
        :param names: the deftemplates or rules; empty for all of them. With ``all``, the names apply to both
            and are not checked.
        :raises ClipsError: if the environment, item or a name is unknown.
        """
        env = self._manager.find(name)
        with env.lock:
            construct = {"facts": "deftemplate", "rules": "defrule"}.get(item)
            # names are checked only for one kind of constructs; `watch` itself refuses unknown items
            defined_names = names if construct is None else construct_names(env, construct)
            unknown_names = [unknown for unknown in names if unknown not in defined_names]
            if unknown_names:
                # CLIPS' own message, which its users know.
                message = f"Unable to find {construct} '{unknown_names[0]}'."
                raise ClipsError(message, hint=did_you_mean(unknown_names[0], defined_names) or None)
            env.watcher.watch(item, names, on=on)

    def set_log_level(self, name: str, level: str) -> None:
        """Set the minimum log level of an environment.

        :param level: ``debug``, ``info``, ``warn`` or ``error``.
        :raises ClipsError: if the environment or level is unknown.
        """
        env, log_level = self._manager.find(name), find_level(level)
        with env.lock:
            env.log_level = log_level
