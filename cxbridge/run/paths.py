"""The paths of the files of a run, from its scenario and, if there is one, a Fawkes checkout."""

from __future__ import annotations

from pathlib import Path

from msgspec import Struct

from cxbridge.config import Configuration
from cxbridge.config.checkouts import Checkouts
from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.executive.executive import BUILTIN_CX
from cxbridge.run.specs import check_files

SCENARIO_FILE = "scenario.yaml"
FAWKES_INTERFACES = "src/libs/interfaces"
FAWKES_PLUGIN_INTERFACES = "src/plugins/*/interfaces"


class RunPaths(Struct, frozen=True):
    """The files and folders of a run.

    :param config_file: the configuration file or folder.
    :param library: utils.clp, time.clp, path.clp.
    :param cx: the CX core.
    :param clips_dirs: the agent's CLIPS files, in the order they are searched after the core's.
    :param interface_dirs: interface definitions, in the order they are searched.
    :param skill_dirs: Lua skills, in the order they are searched.
    :param substitutions: what ``@BASEDIR@`` and its like stand for.
    :param robot_memory: Fawkes' own robot-memory.clp, if it is to be used.
    :param before: folders whose files replace the core's.
    :param checkouts: the folders of ``--overlay`` and ``--fawkes-dir``.
    """

    config_file: Path
    library: Path
    cx: Path
    clips_dirs: tuple[Path, ...]
    interface_dirs: tuple[Path, ...]
    skill_dirs: tuple[Path, ...]
    substitutions: dict[str, str]
    robot_memory: Path | None = None
    before: tuple[Path, ...] = ()
    checkouts: Checkouts = Checkouts()

    @property
    def builtin(self) -> bool:
        """Whether the core is ours."""
        return self.cx == BUILTIN_CX

    @property
    def placeholders(self) -> dict[str, str]:
        """What placeholders stand for, without the ``@`` around their names."""
        return {name.strip("@"): folder for name, folder in self.substitutions.items()}

    @property
    def confdir(self) -> Path:
        """The folder that relative paths in the configuration are seen from."""
        return self.checkouts.confdir(self.config_file)

    def expand(self, text: str) -> list[Path]:
        """Return the folders that a configured path stands for, in the order they are searched."""
        return self.checkouts.expand(text, self.placeholders, self.confdir)


def find_missing(config: Configuration, spec: str, paths: RunPaths) -> list[ConfigError]:
    """Return the missing files of a spec, each with the place of its entry."""
    return check_files(config, spec, (*paths.before, paths.cx, *paths.clips_dirs))


def fawkes_interface_dirs(fawkes: Path) -> list[Path]:
    """Return where a Fawkes checkout has its interface definitions.

    :raises CxbridgeError: when it is none.
    """
    return [fawkes_part(fawkes, FAWKES_INTERFACES), *sorted(fawkes.glob(FAWKES_PLUGIN_INTERFACES))]


def fawkes_part(fawkes: Path, part: str) -> Path:
    """Return a folder of a Fawkes checkout.

    :raises CxbridgeError: when the checkout lacks the folder.
    """
    if not (fawkes / part).is_dir():
        raise CxbridgeError(
            f"this is not a Fawkes checkout: it has no {part}",
            file=fawkes,
            hint="name the top folder of a clone of the Fawkes repository",
        )
    return fawkes / part
