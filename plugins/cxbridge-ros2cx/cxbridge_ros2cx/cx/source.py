"""A parameter file of the ROS 2 CX's node ``clips_manager`` as the source of an agent.

The file names environments and their plug-ins. The source finds the packages with the agent's files, makes
the node's context and manager, and lets the plug-ins load the files.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from cxbridge.clock import MICROSECONDS
from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError
from cxbridge.executive.executive import BUILTIN_CX
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.manager import HOST_LIBRARY
from cxbridge.resources import shipped_dir
from cxbridge.run.paths import RunPaths
from cxbridge.run.rights import read_rights
from cxbridge.run.source import LoadedFile, Source
from cxbridge.run.specs import choose_spec
from cxbridge_protobuf.settings import CONNECTIONS_KEY
from cxbridge_ros2cx.cx.hash_order import order_by_hash
from cxbridge_ros2cx.cx.manager import CxManager
from cxbridge_ros2cx.cx.node import CxNode
from cxbridge_ros2cx.cx.packages import Packages, find_package_folder
from cxbridge_ros2cx.cx.parameters import ENVIRONMENTS, NodeParameters
from cxbridge_ros2cx.cx.plugin import NodeContext
from cxbridge_ros2cx.cx.plugins.executive import find_shortest_period_us
from cxbridge_ros2cx.cx.plugins.file_load import FileLoadPlugin
from cxbridge_ros2cx.cx.ros.node import RosNode
from cxbridge_ros2cx.cx.stock import StockEnvironment

if TYPE_CHECKING:
    from cxbridge.executive.executive import ActionMapper, CoreFiles, Executive
    from cxbridge.executive.feature import Feature, LazyFeature
    from cxbridge.executive.manager import EnvironmentManager
    from cxbridge.run.agent import Run
    from cxbridge_protobuf.connections import MakeConnections
    from cxbridge_protobuf.local_connections import LocalNetwork

# package and file that exist since pull request 33 of carologistics/clips_executive (June 2026)
_FILE_SINCE_2026 = ("cx_msgs", "srv/ClipsCommand.srv")

_CALLBACK_SUFFIX = "-callback"  # suffix of the deffunctions that plug-ins call
_EXECUTIVE_TREE = "/clips-executive"
# the longest time between two receptions of messages on a real clock, which limits the delay of responses
_MAX_LOOP_PERIOD_US = MICROSECONDS // 50


class CxSource(Source):
    """A parameter file with environments and plug-ins."""

    has_fawkes_configuration = False
    needs_skiller = False

    @cached_property
    def parameters(self) -> NodeParameters:
        assert self.options.scenario is not None  # without a parameter file, another source is chosen
        return NodeParameters.load(self.options.scenario)

    @cached_property
    def packages(self) -> Packages:
        """The packages for the agent: those in ``--ros2cx``, then the package of the parameter file."""
        assert self.options.scenario is not None
        own_package, folders = find_package_folder(self.options.scenario), [*self.folders]
        if own_package is not None and not any(
            own_package.is_relative_to(folder.resolve()) for folder in folders
        ):
            folders.append(own_package)
        return Packages.from_folders(folders)

    def check(self) -> None:
        """Check that the options name a parameter file, and have no conflicts with it.

        :raises CxbridgeError: if they do not, or a folder of ``--ros2cx`` does not exist.
        """
        self.check_folders()
        if self.options.scenario is None:
            raise CxbridgeError(
                "the folder is a checkout of the ROS 2 CLIPS Executive, but no parameter file is given",
                file=self.folders[0],
                hint="e.g. params/hello_world.yaml of the package cx_tutorial_agents",
            )
        for name, value in (("fawkes-dir", self.options.fawkes_dir), ("core", self.options.core)):
            if value is not None:
                raise CxbridgeError(
                    f"--{name} cannot be combined with parameters of clips_manager",
                    hint="their environments have no core and no files of Fawkes",
                )

    @property
    def folders(self) -> tuple[Path, ...]:
        """The checkout or workspace of ``--ros2cx``; empty without this option."""
        folder = self.options.option("ros2cx")
        return () if folder is None else (folder,)

    @property
    def is_checkout(self) -> bool:
        """Whether the agent's files belong to a checkout: always, so broken files do not stop the start."""
        return True

    def config_file(self) -> Path:
        return self.parameters.file

    def read_configuration(self, file: Path) -> Configuration:
        """Return a configuration with the environment names."""
        config = Configuration()
        config.set(f"{_EXECUTIVE_TREE}/spec", file.stem)
        config.set(
            f"{_EXECUTIVE_TREE}/specs/{file.stem}/parameters/{ENVIRONMENTS}",
            self.parameters.get_strings(ENVIRONMENTS),
        )
        return config

    def find_overlays(self) -> Sequence[Path]:
        """Return no files: ``--config`` lays files over a configuration of Fawkes only."""
        return ()

    def choose_spec(self, config: Configuration, config_file: Path) -> tuple[str, list[str]]:
        """Return the name of the parameter file; the settings of Fawkes' specs do not exist."""
        return choose_spec(config, self.options.spec, config_file), []

    def find_paths(self, config: Configuration, config_file: Path) -> RunPaths:  # noqa: ARG002 - of Source
        return RunPaths(
            config_file=config_file,
            library_dir=HOST_LIBRARY,
            core_dir=BUILTIN_CX,
            clips_dirs=self.options.clips_dirs,
            interface_dirs=(*self.options.interface_dirs, shipped_dir("interfaces")),
            skill_dirs=self.options.skill_dirs,
            substitutions={},
        )

    def loop_period_us(self, config: Configuration) -> int:  # noqa: ARG002 - of Source
        """Return the period of the fastest executive plug-in, on a real clock a fraction of that period."""
        period_us = find_shortest_period_us(self.parameters)
        if self.options.clock_name == "virtual":
            return period_us
        # the largest fraction that is short enough; -(-a // b) rounds up
        return period_us // -(-period_us // _MAX_LOOP_PERIOD_US)

    def features(self, context: Run) -> list[Feature]:  # noqa: ARG002 - of Source
        """Return no features: the plug-ins of the parameters take their place."""
        return []

    def make_manager(
        self,
        context: Run,
        features: Sequence[Feature | LazyFeature],  # noqa: ARG002 - there are none
        environment: type[ClipsEnvironment],
    ) -> EnvironmentManager:
        parameters, packages = self.parameters, self.packages
        rights, is_inspection = (
            read_rights(context.config, skiller="none"),
            environment is not ClipsEnvironment,  # only commands that inspect agents use another class
        )
        node_context = NodeContext(
            parameters,
            packages,
            context.clock,
            context.bus,
            RosNode(parameters.name, packages, context.clock, context.bus.logger, rights),
            has_2026_changes=packages.has_file(*_FILE_SINCE_2026),
            is_inspection=is_inspection,
        )
        if context.clock.is_virtual:
            node_context.connections = (
                context.additions.values.get(CONNECTIONS_KEY) or _make_local_connections()
            )
        manager = CxManager(
            node_context,
            None if is_inspection else self.options.option("log_dir"),
            environment if is_inspection else StockEnvironment,
        )
        manager.is_strict = not self.is_lenient
        return manager

    def calls(self, function: str) -> bool:
        """Return whether plug-ins call a deffunction, for a request to a service or an action server."""
        return function.endswith(_CALLBACK_SUFFIX)

    def loaded_files(self, manager: EnvironmentManager) -> list[LoadedFile]:
        """Return the files that the plug-ins of all environments load."""
        assert isinstance(manager, CxManager)
        return [
            file
            for plugin in manager.plugins.values()
            if isinstance(plugin, FileLoadPlugin)
            for file in plugin.loaded_files()
        ]

    def make_executive(
        self, context: Run, manager: EnvironmentManager, mapper: ActionMapper, files: CoreFiles
    ) -> Executive:
        assert isinstance(manager, CxManager)
        node = CxNode(manager, context.config, mapper, files)
        if self.options.option("hash_order"):
            node.environment_names = order_by_hash(node.environment_names)
        return node


def _make_local_connections() -> MakeConnections:
    """Return a factory of protobuf connections within this process, all in one network."""

    @cache
    def make_network() -> LocalNetwork:
        from cxbridge_protobuf.local_connections import LocalNetwork  # noqa: PLC0415 - for agents with protobuf

        return LocalNetwork()

    return lambda types, now_us: make_network().join(types, now_us)
