"""Named CLIPS environments and their features, as in Fawkes' `clips` plugin.

An environment requests a feature with ``(ff-feature-request "NAME")`` and gets its functions, templates and
rules. The facts ``(ff-feature NAME)`` list the available features, ``(ff-feature-loaded NAME)`` the loaded
ones. Both survive a reset.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from msgspec import Struct, field

from cxbridge.errors import ClipsError
from cxbridge.events import EventBus, Logger
from cxbridge.executive.feature import Feature, LazyFeature
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Value

HOST_LIBRARY = CORE_DIR / "host"
"""cxbridge's utils.clp, time.clp, path.clp ..., which each environment loads first."""

_LIBRARY_FILES = ("utils.clp", "time.clp", "path.clp")


class _Entry(Struct):
    """An environment with its features.

    :param loaded: the names of the features, sorted.
    :param run_before: the features with work before each run.
    :param functions: the functions by feature.
    """

    environment: ClipsEnvironment
    loaded: list[str] = field(default_factory=list)
    run_before: list[Feature] = field(default_factory=list)
    functions: dict[str, frozenset[str]] = field(default_factory=dict)


class FeatureInfo(Struct, frozen=True):
    """A feature and its environments.

    :param origin: the Python class, or the description of a plug-in that is not loaded.
    :param offered: whether environments may request the feature.
    :param environments: the environments that have loaded the feature.
    """

    name: str
    origin: str
    offered: bool
    environments: tuple[str, ...]


class EnvironmentManager:
    """Creates, finds and destroys environments.

    :param library: the folder of utils.clp, time.clp and path.clp, by default cxbridge's. Fawkes' files need
        Fawkes' own (``src/plugins/clips/clips``).
    :param environment: the class of the environments.
    """

    def __init__(
        self,
        bus: EventBus,
        features: Iterable[Feature | LazyFeature] = (),
        library: Path = HOST_LIBRARY,
        environment: type[ClipsEnvironment] = ClipsEnvironment,
    ) -> None:
        self.bus = bus
        self._environment = environment
        self.library = library
        self.log: Logger = bus.logger("ClipsEnvManager")
        self._features: dict[str, Feature] = {}
        self._lazy: dict[str, LazyFeature] = {}  # stay after their import, for the list of all features
        self._withdrawn: set[str] = set()
        self._entries: dict[str, _Entry] = {}
        self.extra: list[str] = []
        """The environments of clients: their rules run after those of the executive."""
        for feature in features:
            self.add_feature(feature)

    @property
    def features(self) -> tuple[str, ...]:
        """The available features, sorted."""
        return tuple(sorted({*self._features, *self._lazy} - self._withdrawn))

    @property
    def catalogue(self) -> tuple[FeatureInfo, ...]:
        """All features, including withdrawn ones, sorted by name."""
        return tuple(self._info(name) for name in sorted({*self._features, *self._lazy}))

    def _info(self, name: str) -> FeatureInfo:
        feature = self._features.get(name)
        if feature is not None:
            origin = f"{type(feature).__module__}:{type(feature).__qualname__}"
        else:
            origin = self._lazy[name].origin
        users = tuple(env for env, entry in self._entries.items() if name in entry.loaded)
        return FeatureInfo(name, origin, name not in self._withdrawn, users)

    @property
    def environments(self) -> dict[str, ClipsEnvironment]:
        return {name: entry.environment for name, entry in self._entries.items()}

    def find(self, name: str) -> ClipsEnvironment:
        """Return an environment.

        :raises ClipsError: if no environment has this name.
        """
        return self._entry(name).environment

    def _entry(self, name: str) -> _Entry:
        entry = self._entries.get(name)
        if entry is None:
            names = ", ".join(self._entries)
            raise ClipsError(f"there is no CLIPS environment '{name}'", hint=f"there are: {names}")
        return entry

    def add_feature(self, feature: Feature | LazyFeature) -> None:
        """Offer a feature to all environments.

        :raises ClipsError: if the name exists.
        """
        if feature.name in self._features or feature.name in self._lazy:
            raise ClipsError(f"there is a CLIPS feature '{feature.name}' already")
        if isinstance(feature, LazyFeature):
            self.log.info(f"Adding feature {feature.name}{feature.origin and f' ({feature.origin})'}")
            self._lazy[feature.name] = feature
        else:
            self.log.info(f"Adding feature {feature.name}")
            self._features[feature.name] = feature
        self._announce_offer(feature.name)

    def offer(self, name: str) -> None:
        """Offer a withdrawn feature again. Does nothing if it is offered.

        :raises ClipsError: if the feature is unknown.
        """
        self._check_known(name)
        if name in self._withdrawn:
            self.log.info(f"Adding feature {name}")
            self._withdrawn.discard(name)
            self._announce_offer(name)

    def withdraw(self, name: str) -> None:
        """Withdraw a feature: requests return FALSE. Does nothing if it is withdrawn.

        :raises ClipsError: if the feature is unknown or in use.
        """
        self.check_unused(name)
        if name in self._withdrawn:
            return
        self.log.info(f"Removing feature {name}")
        self._withdrawn.add(name)
        for entry in self._entries.values():
            with entry.environment.lock:
                _retract(entry.environment, "ff-feature", name)
                self._build_offers(entry.environment)

    def check_unused(self, name: str) -> None:
        """Check that a feature can be withdrawn.

        :raises ClipsError: if the feature is unknown or in use.
        """
        self._check_known(name)
        users = self._info(name).environments
        if users:
            raise ClipsError(
                f"the CLIPS feature '{name}' cannot be withdrawn: {', '.join(users)} has it",
                hint="remove it from the environment first",
            )

    def _check_known(self, name: str) -> None:
        names = sorted({*self._features, *self._lazy})
        if name not in names:
            raise ClipsError(f"there is no CLIPS feature '{name}'", hint=f"there are: {', '.join(names)}")

    def _announce_offer(self, name: str) -> None:
        """Announce an available feature to the existing environments."""
        for entry in self._entries.values():
            with entry.environment.lock:
                entry.environment.assert_string(f"(ff-feature {name})")
                self._build_offers(entry.environment)

    def _build_offers(self, env: ClipsEnvironment) -> None:
        """Let a reset of the environment assert the available features again."""
        env.build(_deffacts("ff-features-available", "ff-feature", self.features))

    def _find(self, name: str) -> Feature | None:
        """Return a feature, imported if necessary; None if the feature is unknown or withdrawn."""
        if name in self._withdrawn:
            return None
        if name not in self._features and name in self._lazy:
            self._features[name] = self._lazy[name].load()
        return self._features.get(name)

    def create(self, name: str, log_component: str | None = None) -> ClipsEnvironment:
        """Create an environment and load the library.

        :param log_component: the component of the environment's log lines, by default ``CLIPS (NAME)``.
        :raises ClipsError: if the name exists or the library does not load.
        """
        if name in self._entries:
            raise ClipsError(f"CLIPS environment '{name}' already exists")
        env = self._environment(name, self.bus, log_component)
        self.add_environment(env)
        env.define("ff-feature-request", lambda feature: self.request(name, feature), 1, types="*;sy")
        env.watcher.set_hooks()
        for feature in self.features:
            env.assert_string(f"(ff-feature {feature})")
        self._build_offers(env)
        for file in _LIBRARY_FILES:
            if not env.load(self.library / file):
                self.destroy(name)
                raise ClipsError(
                    f"the CLIPS library file {file} does not load",
                    file=self.library / file,
                    hint="see the messages above",
                )
        env.call("path-add", f"{self.library}/")
        return env

    def add_environment(self, env: ClipsEnvironment) -> None:
        """Register an environment from :meth:`create`."""
        self._entries[env.name] = _Entry(env)

    def request(self, name: str, feature_name: str) -> Value:
        """Load a feature into an environment; return TRUE, or FALSE if the feature is unknown."""
        self.log.debug(f"Environment {name} requests feature {feature_name}")
        entry = self._entries[name]
        feature = self._find(feature_name)
        if feature is None:
            self.log.warn(f"Environment requested unavailable feature {feature_name}")
            return FALSE
        if feature_name in entry.loaded:
            self.log.warn(f"Environment {name} requested feature {feature_name} *again*")
            return TRUE
        env = entry.environment
        self.bus.emit_source("feature", name, feature_name)
        existing = env.udfs.names
        feature.init_context(env)
        # the initialisation of the feature may have requested further features
        owned = frozenset[str]().union(*entry.functions.values())
        entry.functions[feature_name] = env.udfs.names - existing - owned
        # most features have no work before a run: calls of their empty methods would cost time in each loop
        if type(feature).before_run is not Feature.before_run:
            entry.run_before.append(feature)
        entry.loaded.append(feature_name)
        entry.loaded.sort()
        env.assert_string(f"(ff-feature-loaded {feature_name})")
        env.build(_deffacts("ff-features-loaded", "ff-feature-loaded", entry.loaded))
        return TRUE

    def destroy_context(self, name: str, feature_name: str) -> None:
        """Remove a feature from an environment. It may be requested again.

        Templates and rules stay. Functions stay known to CLIPS, because rules use them, but calls fail.

        :raises ClipsError: if the environment is unknown or does not have the feature.
        """
        entry = self._entry(name)
        if feature_name not in entry.loaded:
            raise ClipsError(
                f"the environment '{name}' does not have the CLIPS feature '{feature_name}'",
                hint=f"it has: {', '.join(entry.loaded) or 'none'}",
            )
        env, feature = entry.environment, self._features[feature_name]
        with env.lock:
            self.log.info(f"Removing feature {feature_name} from environment {name}")
            feature.context_destroyed(env)
            entry.loaded.remove(feature_name)
            if feature in entry.run_before:
                entry.run_before.remove(feature)
            reason = f"the CLIPS feature '{feature_name}' was removed from the environment '{name}'"
            env.udfs.revoke(entry.functions.pop(feature_name), reason)
            _retract(env, "ff-feature-loaded", feature_name)
            env.build(_deffacts("ff-features-loaded", "ff-feature-loaded", entry.loaded))

    def loaded_features(self, name: str) -> tuple[str, ...]:
        """Return the features of an environment, sorted."""
        return tuple(self._entries[name].loaded)

    def feature_functions(self, name: str) -> dict[str, frozenset[str]]:
        """Return the functions of an environment by feature."""
        return dict(self._entries[name].functions)

    def before_run(self, name: str) -> None:
        """Let features assert new input. The environment must be locked."""
        entry = self._entries[name]
        for feature in entry.run_before:
            feature.before_run(entry.environment)

    def run_extra(self) -> None:
        """Run the rules of the environments of clients, in the order in which they were created."""
        for name in self.extra:
            env = self._entries[name].environment
            with env.lock:
                self.before_run(name)
                env.refresh_agenda()
                env.run()

    def destroy(self, name: str) -> None:
        """Destroy an environment.

        :raises ClipsError: if the environment is unknown.
        """
        entry = self._entry(name)
        del self._entries[name]
        if name in self.extra:
            self.extra.remove(name)
        for feature in entry.loaded:  # while the environment still exists
            self._features[feature].context_destroyed(entry.environment)
        entry.environment.destroy()

    def close(self) -> None:
        for name in list(self._entries):
            self.destroy(name)


def _retract(env: ClipsEnvironment, relation: str, value: str) -> None:
    """Retract the fact ``(RELATION VALUE)``."""
    for index, _, slots in list(env.facts(relation)):
        if slots["implied"] == (value,):
            env.retract(index)


def _deffacts(name: str, relation: str, values: Iterable[str]) -> str:
    """Return a deffacts with the fact ``(RELATION VALUE)`` of each value."""
    facts = " ".join(f"({relation} {value})" for value in values)
    return f"(deffacts {name} {facts})"
