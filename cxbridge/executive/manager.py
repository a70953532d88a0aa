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


class _ManagedEnvironment(Struct):
    """An environment with its features.

    :param feature_names: the names of the features, sorted.
    :param input_features: the features that assert input before each run.
    :param functions: the functions by feature.
    """

    environment: ClipsEnvironment
    feature_names: list[str] = field(default_factory=list)
    input_features: list[Feature] = field(default_factory=list)
    functions: dict[str, frozenset[str]] = field(default_factory=dict)


class FeatureInfo(Struct, frozen=True):
    """A feature and its environments.

    :param origin: the Python class, or the description of a plug-in that is not loaded.
    :param offered: whether environments may request the feature.
    :param environments: the names of the environments that have loaded the feature.
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
        self._lazy_features: dict[str, LazyFeature] = {}  # features that may be imported already
        self._withdrawn: set[str] = set()
        self._managed_environments: dict[str, _ManagedEnvironment] = {}
        self.client_environments: list[str] = []
        """The names of the environments that clients have created. Their rules run after the executive's
        rules."""
        for feature in features:
            self.add_feature(feature)

    @property
    def features(self) -> tuple[str, ...]:
        """The names of the available features, sorted."""
        return tuple(sorted(self._known_names - self._withdrawn))

    @property
    def _known_names(self) -> set[str]:
        return {*self._features, *self._lazy_features}

    @property
    def catalogue(self) -> tuple[FeatureInfo, ...]:
        """All features, including withdrawn features, sorted by name."""
        return tuple(self._feature_info(name) for name in sorted(self._known_names))

    def _feature_info(self, name: str) -> FeatureInfo:
        feature = self._features.get(name)
        if feature is not None:
            origin = f"{type(feature).__module__}:{type(feature).__qualname__}"
        else:
            origin = self._lazy_features[name].origin
        users = tuple(env for env, entry in self._managed_environments.items() if name in entry.feature_names)
        return FeatureInfo(name, origin, name not in self._withdrawn, users)

    @property
    def environments(self) -> dict[str, ClipsEnvironment]:
        return {name: entry.environment for name, entry in self._managed_environments.items()}

    def find(self, name: str) -> ClipsEnvironment:
        """Return an environment.

        :raises ClipsError: if no environment has this name.
        """
        return self._managed_environment(name).environment

    def _managed_environment(self, name: str) -> _ManagedEnvironment:
        entry = self._managed_environments.get(name)
        if entry is None:
            names = ", ".join(self._managed_environments)
            raise ClipsError(f"there is no CLIPS environment '{name}'", hint=f"there are: {names}")
        return entry

    def add_feature(self, feature: Feature | LazyFeature) -> None:
        """Offer a feature to all environments.

        :raises ClipsError: if the name exists.
        """
        if feature.name in self._known_names:
            raise ClipsError(f"a CLIPS feature '{feature.name}' already exists")
        if isinstance(feature, LazyFeature):
            self.log.info(f"Adding feature {feature.name}{feature.origin and f' ({feature.origin})'}")
            self._lazy_features[feature.name] = feature
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
        for entry in self._managed_environments.values():
            with entry.environment.lock:
                _retract(entry.environment, "ff-feature", name)
                self._build_offers(entry.environment)

    def check_unused(self, name: str) -> None:
        """Check that a feature can be withdrawn.

        :raises ClipsError: if the feature is unknown or in use.
        """
        self._check_known(name)
        users = self._feature_info(name).environments
        if users:
            raise ClipsError(
                f"the CLIPS feature '{name}' cannot be withdrawn: it is in use by {', '.join(users)}",
                hint="remove it from the environment first",
            )

    def _check_known(self, name: str) -> None:
        if name not in self._known_names:
            names = ", ".join(sorted(self._known_names))
            raise ClipsError(f"there is no CLIPS feature '{name}'", hint=f"there are: {names}")

    def _announce_offer(self, name: str) -> None:
        """Assert the fact of an available feature in the existing environments."""
        for entry in self._managed_environments.values():
            with entry.environment.lock:
                entry.environment.assert_string(f"(ff-feature {name})")
                self._build_offers(entry.environment)

    def _build_offers(self, env: ClipsEnvironment) -> None:
        """Let a reset of the environment assert the available features again."""
        env.build(_deffacts_text("ff-features-available", "ff-feature", self.features))

    def _available_feature(self, name: str) -> Feature | None:
        """Return a feature, and import it if necessary; None if the feature is unknown or withdrawn."""
        if name in self._withdrawn:
            return None
        if name not in self._features and name in self._lazy_features:
            self._features[name] = self._lazy_features[name].load()
        return self._features.get(name)

    def create(self, name: str, log_component: str | None = None) -> ClipsEnvironment:
        """Create an environment and load the library.

        :param log_component: the component of the environment's log lines, by default ``CLIPS (NAME)``.
        :raises ClipsError: if the name exists or the library does not load.
        """
        if name in self._managed_environments:
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
        self._managed_environments[env.name] = _ManagedEnvironment(env)

    def request(self, name: str, feature_name: str) -> Value:
        """Load a feature into an environment; return FALSE if the feature is unknown or withdrawn."""
        self.log.debug(f"Environment {name} requests feature {feature_name}")
        entry = self._managed_environments[name]
        feature = self._available_feature(feature_name)
        if feature is None:
            self.log.warn(f"Environment requested unavailable feature {feature_name}")
            return FALSE
        if feature_name in entry.feature_names:
            self.log.warn(f"Environment {name} requested feature {feature_name} *again*")
            return TRUE
        env = entry.environment
        self.bus.emit_source("feature", name, feature_name)
        earlier_functions = env.udfs.names
        feature.init_context(env)
        # the initialisation may have requested further features, whose functions are recorded already
        recorded_functions = frozenset[str]().union(*entry.functions.values())
        entry.functions[feature_name] = env.udfs.names - earlier_functions - recorded_functions
        # most features have no input: calls of their empty methods would cost time in each loop
        if type(feature).before_run is not Feature.before_run:
            entry.input_features.append(feature)
        entry.feature_names.append(feature_name)
        entry.feature_names.sort()
        env.assert_string(f"(ff-feature-loaded {feature_name})")
        env.build(_deffacts_text("ff-features-loaded", "ff-feature-loaded", entry.feature_names))
        return TRUE

    def destroy_context(self, name: str, feature_name: str) -> None:
        """Remove a feature from an environment. It may be requested again.

        Templates and rules stay. Functions stay, too, because rules use them, but their calls fail.

        :raises ClipsError: if the environment is unknown or does not have the feature.
        """
        entry = self._managed_environment(name)
        if feature_name not in entry.feature_names:
            raise ClipsError(
                f"the environment '{name}' does not have the CLIPS feature '{feature_name}'",
                hint=f"it has: {', '.join(entry.feature_names) or 'none'}",
            )
        env, feature = entry.environment, self._features[feature_name]
        with env.lock:
            self.log.info(f"Removing feature {feature_name} from environment {name}")
            feature.context_destroyed(env)
            entry.feature_names.remove(feature_name)
            if feature in entry.input_features:
                entry.input_features.remove(feature)
            reason = f"the CLIPS feature '{feature_name}' was removed from the environment '{name}'"
            env.udfs.revoke(entry.functions.pop(feature_name), reason)
            _retract(env, "ff-feature-loaded", feature_name)
            env.build(_deffacts_text("ff-features-loaded", "ff-feature-loaded", entry.feature_names))

    def loaded_features(self, name: str) -> tuple[str, ...]:
        """Return the features of an environment, sorted."""
        return tuple(self._managed_environments[name].feature_names)

    def feature_functions(self, name: str) -> dict[str, frozenset[str]]:
        """Return the functions of an environment by feature."""
        return dict(self._managed_environments[name].functions)

    def before_run(self, name: str) -> None:
        """Let features assert new input. The environment must be locked."""
        entry = self._managed_environments[name]
        for feature in entry.input_features:
            feature.before_run(entry.environment)

    def run_client_environments(self) -> None:
        """Run the rules of :attr:`client_environments`, in the order of creation."""
        for name in self.client_environments:
            env = self._managed_environments[name].environment
            with env.lock:
                self.before_run(name)
                env.refresh_agenda()
                env.run()

    def destroy(self, name: str) -> None:
        """Destroy an environment.

        :raises ClipsError: if the environment is unknown.
        """
        entry = self._managed_environment(name)
        del self._managed_environments[name]
        if name in self.client_environments:
            self.client_environments.remove(name)
        for feature in entry.feature_names:  # while the environment still exists
            self._features[feature].context_destroyed(entry.environment)
        entry.environment.destroy()

    def close(self) -> None:
        for name in list(self._managed_environments):
            self.destroy(name)


def _retract(env: ClipsEnvironment, relation: str, value: str) -> None:
    """Retract the fact ``(RELATION VALUE)``."""
    for index, _, slots in list(env.facts(relation)):
        if slots["implied"] == (value,):
            env.retract(index)


def _deffacts_text(name: str, relation: str, values: Iterable[str]) -> str:
    """Return a deffacts with a fact ``(RELATION VALUE)`` for each value."""
    facts = " ".join(f"({relation} {value})" for value in values)
    return f"(deffacts {name} {facts})"
