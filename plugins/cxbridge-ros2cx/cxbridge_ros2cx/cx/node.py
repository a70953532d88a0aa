"""The node ``clips_manager`` of the ROS 2 CX as the executive of a run.

The node owns environments with their plug-ins. It is a managed node of ROS: its activation loads the plug-ins
and runs the first rules, its ticks let plug-ins run rules, and its deactivation unloads the plug-ins.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from cxbridge.events import Level, LogLine
from cxbridge.executive.executive import MAX_FINAL_FIRINGS, Executive
from cxbridge_ros2cx.cx.manager import CxManager, read_environment_names

if TYPE_CHECKING:
    from cxbridge.config import Configuration
    from cxbridge.events import Event
    from cxbridge.executive.executive import ActionMapper, CoreFiles
    from cxbridge_ros2cx.cx.ros.node_services import NodeServices
    from cxbridge_ros2cx.cx.stock import StockEnvironment

# transitions of a managed node; cxbridge_ros2.lifecycle has the same names, but is slow to import
CONFIGURE, ACTIVATE, DEACTIVATE, SHUTDOWN = "configure", "activate", "deactivate", "shutdown"


class CxNode(Executive):
    """The node. Rules run at its activation, at its end, and at each tick of an executive plug-in.

    :param manager: the owner of the environments and plug-ins.
    """

    knows_goals: ClassVar[bool] = False
    manager: CxManager

    def __init__(
        self, manager: CxManager, config: Configuration, mapper: ActionMapper, files: CoreFiles
    ) -> None:
        self.environment_names = read_environment_names(manager.context)
        self._first_error = ""
        self._fired_count = 0
        self._is_active = self._was_active = False
        self._node_name = manager.context.parameters.name.strip("/")
        self._services: NodeServices | None = None
        manager.context.run_environment = self._run_environment
        manager.bus.subscribe(self._remember_first_error, LogLine)
        manager.log.info(f"Configuring [{self._node_name}]...")
        super().__init__(manager, config, mapper, files, self.environment_names[0])
        # an inspection loads all plug-ins into the first environment: see load_core
        for name in () if manager.context.is_inspection else self.environment_names[1:]:
            manager.create(name)

    def _remember_first_error(self, event: Event) -> None:
        assert isinstance(event, LogLine)
        if event.level is Level.ERROR and not self._first_error:
            # not empty, since an empty text means that there is no error
            self._first_error = event.text.strip().partition("\n")[0] or "an empty line"

    @property
    def first_error(self) -> str:
        return self._first_error

    def init(self) -> None:
        """Activate the node and offer its services to peers.

        With ``autostart_node: false`` a node with peers waits until a peer activates it.
        """
        context = self.manager.context
        # true, as in the launch file of the ROS 2 CX; without a launch file its node defaults to false
        if context.parameters.get("autostart_node", default=True) or not context.ros.has_peers:
            self.activate()
        if context.ros.has_peers:
            from cxbridge_ros2.lifecycle import LifecycleState  # noqa: PLC0415 - slow to import, unneeded without peers
            from cxbridge_ros2cx.cx.ros.node_services import NodeServices  # noqa: PLC0415 - likewise

            transitions = {
                CONFIGURE: lambda: True,  # the environments exist from the start
                ACTIVATE: self.activate,
                DEACTIVATE: self.deactivate,
                SHUTDOWN: self._shut_down,
            }
            self._services = NodeServices(
                self.manager,
                transitions,
                LifecycleState.ACTIVE if self._is_active else LifecycleState.UNCONFIGURED,
            )

    def activate(self) -> bool:
        """Load the plug-ins of each environment, then reset and run each environment.

        :returns: True: this transition of a managed node always succeeds.
        """
        self.manager.log.info(f"Activating [{self._node_name}]...")
        if self._was_active:  # the plug-ins define their functions and templates again
            for name in self.environment_names:
                self.manager.stock_environment(name).clear()
        self._is_active = self._was_active = True
        for name in self.environment_names:
            self.manager.load_plugins(name)
        # as in the ROS 2 CX, no rule fires before all environments have their plug-ins
        for env in map(self.manager.stock_environment, self.environment_names):
            env.watcher.set_hooks()
            with env.lock:
                env.reset()
                self._run_environment(env)
            env.emit_settings()
        self._receive_messages()
        self.manager.log.info(f"Activated [{self._node_name}]...")
        return True

    def _shut_down(self) -> bool:
        self.env.quit_requested = True  # the run ends after the loop
        return True

    def load_core(self) -> None:
        """Load the plug-ins of all environments into the first, for commands that inspect agents."""
        loaded_plugins: set[str] = set()
        for name in self.environment_names:
            for plugin in self.manager.context.parameters.get_strings(f"{name}.plugins"):
                if plugin not in loaded_plugins:
                    loaded_plugins.add(plugin)
                    self.manager.request(self.environment_names[0], plugin)

    def _run_environment(self, env: StockEnvironment) -> int:
        """Run an environment's rules until its agenda is empty; return the number of fired rules.

        The caller holds the environment's lock.
        """
        env.refresh_agenda()
        fired_count = self._run() if env is self.env else env.run()
        self._fired_count += fired_count
        return fired_count

    def loop(self) -> int:
        """Let plug-ins do the work that is due; return the number of fired rules.

        If the debugger has stopped within a loop, only the stopped run of the rules continues.
        """
        if self.control is not None and self.control.is_within_loop:
            return self.control.run()
        self._receive_messages()  # before the ticks, so that plug-ins see the messages since the last loop
        for plugin in list(self.manager.plugins.values()):
            self.manager.attempt(plugin, plugin.tick)
        if self._services is not None:
            self._services.tick()
        self._receive_messages()  # the messages that nodes of this process have sent during the ticks
        fired_count, self._fired_count = self._fired_count, 0
        return fired_count

    def _receive_messages(self) -> None:
        """Receive the messages of other nodes."""
        self.manager.context.ros.spin()
        for plugin in list(self.manager.plugins.values()):
            self.manager.attempt(plugin, plugin.receive_messages)

    @property
    def is_over(self) -> bool:
        """Whether an agent has requested the end."""
        return any(env.quit_requested for env in self.manager.environments.values())

    @property
    def maintaining_goals(self) -> list[str]:
        """Always empty: this executive has no goals."""
        return []

    @property
    def initialized(self) -> bool:
        return self._is_active

    def follow_transitions(self) -> None:
        """Do nothing: agents have their own templates, so the executive knows no goals to follow."""

    def deactivate(self) -> bool:
        """Run the shutdown rules and unload the plug-ins; the environments stay.

        :returns: True: this transition of a managed node always succeeds.
        """
        self.manager.log.info(f"Deactivating [{self._node_name}]...")
        self._is_active = False
        # the environments of the parameters first, in their order, then the environments created at run time
        names = sorted(
            self.manager.environments, key=lambda name: (*self.environment_names, name).index(name)
        )
        for env in map(self.manager.stock_environment, names):
            with env.lock:
                env.assert_string("(executive-finalize)")
                env.refresh_agenda()
                if env.run(MAX_FINAL_FIRINGS) >= MAX_FINAL_FIRINGS:
                    env.log.error(
                        f"{MAX_FINAL_FIRINGS} rules fired after (executive-finalize) without coming to an end"
                    )
                env.emit_settings()
        for name in names:
            self.manager.unload_plugins(name)
        self.manager.finalize_plugins()
        self.manager.log.info(f"Deactivated [{self._node_name}]...")
        return True

    def finalize(self) -> None:
        """Deactivate the node; environments stay until :meth:`close`."""
        if self._is_active:
            self.deactivate()
        if self._services is not None:
            self._services.close()
