"""Finds the files of the agent that the options select."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from msgspec import Struct

from cxbridge.config import Configuration
from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.run.agents import agent_names, choose_agent
from cxbridge.run.features import FEATURES
from cxbridge.run.options import RunOptions
from cxbridge.run.paths import RunPaths
from cxbridge.run.source import source_of
from cxbridge.run.specs import choose_spec
from cxbridge_studio.lsp.session import find_agent_files

_HOST_FOLDERS: Final = ("host", "features")  # the folders below CORE_DIR with the CLIPS files of the host


class AgentFiles(Struct, frozen=True):
    """The locations of an agent's files.

    :param library: the CLIPS files that the host can load for any agent, such as the files of features.
    """

    config: Configuration
    spec: str
    paths: RunPaths
    library: tuple[Path, ...] = ()

    @classmethod
    def find(cls, options: RunOptions) -> AgentFiles:
        """Return the locations of an agent's files, by default of the first agent in the configuration.

        :raises CxbridgeError: if the configuration cannot be read, or lacks the agent or the spec.
        """
        source = source_of(options)
        config, config_file = source.load_configuration()
        names = [options.agent] if options.agent else agent_names(config)
        if names:
            config = choose_agent(config, names[0])
        spec = choose_spec(config, options.spec)
        paths = source.find_paths(config, config_file)
        return cls(config, spec, paths, tuple(_find_host_files(paths)))

    def find_clips_files(self) -> Iterator[Path]:
        """Yield the CLIPS files that a spec can load by name."""
        for folder in self.paths.rule_dirs:
            yield from find_agent_files(folder, (".clp",))

    def find_named_files(self) -> Iterator[Path]:
        """Yield the files of the interfaces and skills whose names the agent can use."""
        for folder in self.paths.interface_dirs:
            yield from sorted(folder.glob("*.xml"))
        for folder in self.paths.skill_dirs:
            yield from find_agent_files(folder, (".lua",))


def _find_host_files(paths: RunPaths) -> Iterator[Path]:
    """Yield the CLIPS files that the host loads for every agent, or for an agent that requests a feature."""
    yield from sorted(paths.library_dir.glob("*.clp"))
    for folder in _HOST_FOLDERS:
        yield from sorted((CORE_DIR / folder).glob("*.clp"))
    for module in dict.fromkeys(row.target.partition(":")[0] for row in FEATURES.rows if row.origin):
        module_spec = find_spec(module)  # the folder of a feature's module has its CLIPS files
        if module_spec is not None and module_spec.origin is not None:
            yield from sorted(Path(module_spec.origin).parent.glob("*.clp"))
    # Like the feature `robot_memory`, take the file of a Fawkes checkout if the core comes from there. The
    # folders of Fawkes' plug-ins are neighbours.
    fawkes_file = paths.core_dir.parents[1] / "clips-robot-memory" / "robot-memory.clp"
    yield fawkes_file if fawkes_file.is_file() else CORE_DIR / "cx" / "robot-memory.clp"
