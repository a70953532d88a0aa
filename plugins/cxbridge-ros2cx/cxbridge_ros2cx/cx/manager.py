"""The life cycle of a node's environments and plug-ins, in the order of the ROS 2 CX.

Environments are created without plug-ins. Plug-ins are created at their first request, loaded into
environments, unloaded in reverse order, and finalized after the last environment has unloaded them.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import FALSE, TRUE
from cxbridge.executive.manager import EnvironmentManager
from cxbridge_ros2cx.cx.log_files import EnvironmentLog
from cxbridge_ros2cx.cx.parameters import ENVIRONMENTS
from cxbridge_ros2cx.cx.plugin import CxPlugin, NodeContext, find_plugin_maker, locate_error, read_class_name
from cxbridge_ros2cx.cx.stock import StockEnvironment

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value


class CxManager(EnvironmentManager):
    """The environments and plug-ins of a node. In this manager, the features of the base class are plug-ins.

    :param context: the state that all plug-ins share.
    :param log_folder: the folder for the log files of the environments; None for no files.
    :param environment: the class of the environments; commands that inspect agents use another class.
    """

    def __init__(
        self,
        context: NodeContext,
        log_folder: Path | None,
        environment: type[ClipsEnvironment] = StockEnvironment,
    ) -> None:
        super().__init__(context.bus, environment=environment)
        self.context = context
        self.log = context.bus.logger(context.parameters.name.rpartition("/")[2])
        self.plugin_log = context.bus.logger("CLIPSPluginManager")
        self._log_folder = log_folder
        self._log_files: list[EnvironmentLog] = []
        self.plugins: dict[str, CxPlugin] = {}  # created plug-ins by name
        self._loaded_plugins: dict[str, list[str]] = {}  # plug-ins in loading order, by environment
        self._reported_errors: set[str] = set()
        # whether a plug-in that cannot be created is an error; otherwise the environment runs without it
        self.is_strict = False

    def create(self, name: str, log_component: str | None = None) -> ClipsEnvironment:
        """Create an environment without its plug-ins.

        :param log_component: the component of its lines in the log; by default the name.
        :raises CxbridgeError: if the name is taken, a parameter of the environment is invalid, or its
            log file is not writable.
        """
        if name in self._managed_environments:
            # the text of the ROS 2 CX, with its misspelling
            raise ClipsError(f"Enviroment {name} already exists!")
        parameters = self.context.parameters
        watch_items = parameters.get_strings(f"{name}.watch")
        redirects_stdout = parameters.get(f"{name}.redirect_stdout_to_debug", default=False)
        env = self._environment_class(name, self.bus, log_component or name)
        self.add_environment(env)
        self._loaded_plugins[name] = []
        if self._log_folder is not None:  # before the plug-ins, whose output belongs to the file
            log_file = EnvironmentLog(self._log_folder, name, self.bus.clock)
            self._log_files.append(log_file)
            env.line_listeners["file"] = log_file.write
        if not isinstance(env, StockEnvironment):  # an environment for inspection, in which no rule fires
            return env
        try:
            env.watch_items(watch_items)
        except ClipsError as error:
            # an unknown item: the error below names its place in the parameter file
            self.destroy(name)
            raise parameters.make_error(f"{name}.watch", f"has an {error.message}", error.hint) from None
        if redirects_stdout:
            env.redirect_stdout_to_debug()
        env.watcher.set_hooks()
        self.log.info(f"Initialized new CLIPS environment: {name}")
        return env

    def stock_environment(self, name: str) -> StockEnvironment:
        env = self.find(name)
        assert isinstance(env, StockEnvironment)
        return env

    def load_plugins(self, name: str) -> None:
        """Load the plug-ins of an environment in the order of the parameters.

        :raises CxbridgeError: if the list of plug-ins is invalid, or in the cases of :meth:`request`.
        """
        self.plugin_log.info(f"Loading plugins for {name}.")
        for plugin_name in self.context.parameters.get_strings(f"{name}.plugins"):
            self.request(name, plugin_name)

    def request(self, name: str, feature_name: str) -> Value:
        """Load a plug-in into an environment; return FALSE if that fails.

        :raises CxbridgeError: if the plug-in cannot be created and the manager is strict.
        """
        env, functions_by_plugin = self.find(name), self._managed_environments[name].functions
        try:
            plugin = self._provide_plugin(feature_name)
        except Exception as error:  # noqa: BLE001 - a plug-in of another package may raise anything
            located_error = locate_error(feature_name, error)
            if self.is_strict:
                raise located_error from None
            self.plugin_log.error(str(located_error))
            return FALSE
        with env.lock:
            # as in the ROS 2 CX, a second request defines all functions again
            env.udfs.revoke(functions_by_plugin.get(feature_name, ()), "")
            previous_names = env.udfs.names
            if not self.attempt(plugin, partial(plugin.init_context, env)):
                return FALSE
            functions_by_plugin[feature_name] = env.udfs.names - previous_names
        self._loaded_plugins[name].append(feature_name)
        return TRUE

    def attempt(self, plugin: CxPlugin, work: Callable[[], None]) -> bool:
        """Run a plug-in's work, and return whether the work succeeded.

        Equal errors are logged once: a plug-in that fails in each loop would flood the log.
        """
        try:
            work()
        except Exception as error:  # noqa: BLE001 - a plug-in of another package may raise anything
            text = str(locate_error(plugin.name, error))
            if text not in self._reported_errors:
                self._reported_errors.add(text)
                plugin.log.error(text)
            return False
        return True

    def _provide_plugin(self, plugin_name: str) -> CxPlugin:
        """Return a plug-in; the first request creates the plug-in."""
        if plugin_name not in self.plugins:
            class_name = read_class_name(plugin_name, self.context.parameters)
            plugin = find_plugin_maker(plugin_name, class_name, self.context)(plugin_name, self.context)
            self.plugin_log.info(f"Created plugin: {plugin_name} of type {class_name} on activation")
            plugin.initialize()
            self.plugins[plugin_name] = plugin
        return self.plugins[plugin_name]

    def loaded_features(self, name: str) -> tuple[str, ...]:
        """Return the plug-ins of an environment in loading order."""
        return tuple(self._loaded_plugins[name])

    def destroy_context(self, name: str, feature_name: str) -> None:
        """Unload a plug-in from an environment.

        :raises ClipsError: if the environment lacks the plug-in.
        """
        env = self.stock_environment(name)
        if feature_name not in self._loaded_plugins[name]:
            raise ClipsError(
                f"the environment '{name}' does not have the plug-in '{feature_name}'",
                hint=f"it has: {', '.join(self._loaded_plugins[name]) or 'none'}",
            )
        with env.lock:
            self._unload(env, feature_name)

    def _unload(self, env: ClipsEnvironment, plugin_name: str) -> None:
        plugin = self.plugins[plugin_name]
        self.attempt(plugin, partial(plugin.context_destroyed, env))
        self._loaded_plugins[env.name].remove(plugin_name)
        # a plug-in that was loaded twice keeps its functions until the second unloading
        if plugin_name not in self._loaded_plugins[env.name]:
            env.udfs.revoke(
                self._managed_environments[env.name].functions.pop(plugin_name, ()),
                f"the plug-in '{plugin_name}' was unloaded from the environment '{env.name}'",
            )

    def unload_plugins(self, name: str) -> None:
        """Unload all plug-ins of an environment, the last one first."""
        env = self.find(name)
        with env.lock:
            for plugin_name in reversed(self._loaded_plugins[name][:]):
                self._unload(env, plugin_name)

    def finalize_plugins(self) -> None:
        """Finalize all plug-ins after their environments have unloaded them."""
        for plugin_name in reversed(list(self.plugins)):
            plugin = self.plugins.pop(plugin_name)
            self.attempt(plugin, plugin.finalize)
            self.plugin_log.info(f"[{plugin_name}] Deactivated!")

    def destroy(self, name: str) -> None:
        """Unload the plug-ins of an environment, then destroy the environment."""
        env = self.find(name)
        self.unload_plugins(name)
        del self._managed_environments[name], self._loaded_plugins[name]
        env.destroy()

    def close(self) -> None:
        """Destroy all environments, finalize all plug-ins, leave ROS and close the log files."""
        super().close()
        self.finalize_plugins()
        self.context.ros.close()
        while self._log_files:
            self._log_files.pop().close()


def read_environment_names(context: NodeContext) -> tuple[str, ...]:
    """Return the environment names in the parameters.

    :raises ConfigError: if the list is missing, is empty, or has a repeated or invalid name.
    """
    parameters = context.parameters
    names = parameters.get_strings(ENVIRONMENTS)
    if parameters.find(ENVIRONMENTS) is None:
        raise parameters.make_error(
            ENVIRONMENTS,
            "is missing: these are parameters of another node",
            "pass the parameter file of clips_manager; the file of a learner is for gymnasium.make",
        )
    if not names:
        raise parameters.make_error(
            ENVIRONMENTS, "must name an environment", f'write {ENVIRONMENTS}: ["NAME"]'
        )
    for name in names:
        if names.count(name) > 1:
            raise parameters.make_error(
                ENVIRONMENTS, f"names the environment '{name}' twice", "name each environment once"
            )
        if "/" in name or not name:
            raise parameters.make_error(
                ENVIRONMENTS, f"has the invalid environment name '{name}'", "use a name without slashes"
            )
    return names
