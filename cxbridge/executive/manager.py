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
"""The folder of cxbridge's utils.clp, time.clp and path.clp, which environments load first by default."""

# in the order in which Fawkes loads these files
_LIBRARY_FILES = ("utils.clp", "time.clp", "path.clp")


class _ManagedEnvironment(Struct):
    """An environment with its features.

    :param features: the loaded features by name; a feature that another one requests while it loads comes
        first.
    :param functions: the names of the functions by feature.
    """

    environment: ClipsEnvironment
    features: dict[str, Feature] = field(default_factory=dict)
    functions: dict[str, frozenset[str]] = field(default_factory=dict)


class FeatureInfo(Struct, frozen=True):
    """A feature and its environments.

    :param origin: the Python class; for a feature that is not imported, module and plug-in, empty for
        cxbridge's features.
    :param environments: the names of the environments that have loaded the feature.
    """

    name: str
    origin: str
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
        self.bus, self.library, self._environment_class = bus, library, environment
        self.log: Logger = bus.logger("ClipsEnvManager")
        self._features: dict[str, Feature | LazyFeature] = {}
        self._managed_environments: dict[str, _ManagedEnvironment] = {}
        self.client_environments: list[str] = []
        """The names of the environments that clients have created. Their rules run after the executive's
        rules."""
        for feature in features:
            self.add_feature(feature)

    @property
    def features(self) -> tuple[str, ...]:
        """The names of the available features, sorted."""
        return tuple(sorted(self._features))

    @property
    def catalogue(self) -> tuple[FeatureInfo, ...]:
        """All features, sorted by name."""
        return tuple(
            FeatureInfo(
                name,
                feature.origin
                if isinstance(feature, LazyFeature)
                else f"{type(feature).__module__}:{type(feature).__qualname__}",
                tuple(env for env, managed in self._managed_environments.items() if name in managed.features),
            )
            for name, feature in sorted(self._features.items())
        )

    @property
    def environments(self) -> dict[str, ClipsEnvironment]:
        return {name: managed.environment for name, managed in self._managed_environments.items()}

    def find(self, name: str) -> ClipsEnvironment:
        """Return an environment.

        :raises ClipsError: if no environment has this name.
        """
        return self._managed_environment(name).environment

    def _managed_environment(self, name: str) -> _ManagedEnvironment:
        managed = self._managed_environments.get(name)
        if managed is None:
            raise ClipsError(
                f"there is no CLIPS environment '{name}'",
                hint=f"there are: {', '.join(self._managed_environments)}",
            )
        return managed

    def add_feature(self, feature: Feature | LazyFeature) -> None:
        """Make a feature available to all environments.

        Only environments that are created later get the fact ``ff-feature``.

        :raises ClipsError: if the name exists.
        """
        if feature.name in self._features:
            raise ClipsError(f"a CLIPS feature '{feature.name}' already exists")
        origin = f" ({feature.origin})" if isinstance(feature, LazyFeature) and feature.origin else ""
        self.log.info(f"Adding feature {feature.name}{origin}")
        self._features[feature.name] = feature

    def _available_feature(self, name: str) -> Feature | None:
        """Return a feature, and import it if necessary; None if the feature is unknown."""
        feature = self._features.get(name)
        if isinstance(feature, LazyFeature):
            feature = self._features[name] = feature.load()
        return feature

    def create(self, name: str, log_component: str | None = None) -> ClipsEnvironment:
        """Create an environment and load the library.

        :param log_component: the component of the environment's log lines, by default ``CLIPS (NAME)``.
        :raises ClipsError: if the name exists or the library does not load.
        """
        if name in self._managed_environments:
            raise ClipsError(f"CLIPS environment '{name}' already exists")
        env = self._environment_class(name, self.bus, log_component)
        self.add_environment(env)
        env.define("ff-feature-request", lambda feature: self.request(name, feature), 1, types="*;sy")
        env.watcher.set_hooks()
        # the facts hold now, the deffacts restores them after a reset
        for feature in self.features:
            env.assert_string(f"(ff-feature {feature})")
        env.build(_deffacts_text("ff-features-available", "ff-feature", self.features))
        for file in _LIBRARY_FILES:
            if not env.load(self.library / file):
                self.destroy(name)
                raise ClipsError(
                    f"the CLIPS library file {file} does not load",
                    file=self.library / file,
                    hint="the log has the mistakes",
                )
        env.call("path-add", f"{self.library}/")
        return env

    def add_environment(self, env: ClipsEnvironment) -> None:
        """Register an environment from :meth:`create`."""
        self._managed_environments[env.name] = _ManagedEnvironment(env)

    def request(self, name: str, feature_name: str) -> Value:
        """Load a feature into an environment; return TRUE, or FALSE if the feature is unknown.

        The feature is loaded once: a further request returns TRUE after a warning. The texts of the log
        lines are those of Fawkes.
        """
        self.log.debug(f"Environment {name} requests feature {feature_name}")
        managed = self._managed_environments[name]
        feature = self._available_feature(feature_name)
        if feature is None:
            self.log.warn(f"Environment requested unavailable feature {feature_name}")
            return FALSE
        if feature_name in managed.features:
            self.log.warn(f"Environment {name} requested feature {feature_name} *again*")
            return TRUE
        env = managed.environment
        self.bus.emit_source("feature", name, feature_name)
        earlier_functions = env.udfs.names
        feature.init_context(env)
        # the initialisation may have requested further features, whose functions are recorded already
        managed.functions[feature_name] = (env.udfs.names - earlier_functions).difference(
            *managed.functions.values()
        )
        managed.features[feature_name] = feature
        env.assert_string(f"(ff-feature-loaded {feature_name})")
        env.build(_deffacts_text("ff-features-loaded", "ff-feature-loaded", sorted(managed.features)))
        return TRUE

    def loaded_features(self, name: str) -> tuple[str, ...]:
        """Return the names of the loaded features of an environment, sorted."""
        return tuple(sorted(self._managed_environments[name].features))

    def feature_functions(self, name: str) -> dict[str, frozenset[str]]:
        """Return the names of an environment's functions by feature."""
        return dict(self._managed_environments[name].functions)

    def before_run(self, name: str) -> None:
        """Let an environment's features assert new input. The caller must hold the environment's lock."""
        managed = self._managed_environments[name]
        for feature in managed.features.values():
            feature.before_run(managed.environment)

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
        managed = self._managed_environment(name)
        del self._managed_environments[name]
        if name in self.client_environments:
            self.client_environments.remove(name)
        for feature in managed.features.values():  # while the environment still exists
            feature.context_destroyed(managed.environment)
        managed.environment.destroy()

    def close(self) -> None:
        for name in list(self._managed_environments):
            self.destroy(name)


def _deffacts_text(name: str, relation: str, values: Iterable[str]) -> str:
    """Return a deffacts with a fact ``(RELATION VALUE)`` for each value."""
    return f"(deffacts {name} {' '.join(f'({relation} {value})' for value in values)})"
