"""Paths of a run's files, from the scenario and an optional Fawkes checkout."""

from __future__ import annotations

from pathlib import Path

from msgspec import Struct

from cxbridge.config.checkouts import Checkouts
from cxbridge.errors import CxbridgeError
from cxbridge.executive.executive import BUILTIN_CX

SCENARIO_FILE = "scenario.yaml"
FAWKES_INTERFACES = "src/libs/interfaces"
FAWKES_PLUGIN_INTERFACES = "src/plugins/*/interfaces"


class RunPaths(Struct, frozen=True):
    """Files and folders of a run.

    :param config_file: the configuration file or folder.
    :param library_dir: the folder of utils.clp, time.clp and path.clp.
    :param core_dir: the folder of the CX core.
    :param clips_dirs: the agent's CLIPS folders in search order, after the folder of the core.
    :param interface_dirs: folders of interface definitions in search order.
    :param skill_dirs: folders of Lua skills in search order.
    :param substitutions: the values of placeholders by name, e.g. ``@BASEDIR@``.
    :param override_dirs: folders whose files hide files of the core with the same name.
    :param checkouts: the folders of ``--overlay`` and ``--fawkes-dir``.
    """

    config_file: Path
    library_dir: Path
    core_dir: Path
    clips_dirs: tuple[Path, ...]
    interface_dirs: tuple[Path, ...]
    skill_dirs: tuple[Path, ...]
    substitutions: dict[str, str]
    override_dirs: tuple[Path, ...] = ()
    checkouts: Checkouts = Checkouts()

    @property
    def has_builtin_core(self) -> bool:
        """Whether the CX core is cxbridge's own."""
        return self.core_dir == BUILTIN_CX

    @property
    def rule_dirs(self) -> tuple[Path, ...]:
        """The folders of CLIPS files in search order."""
        return (*self.override_dirs, self.core_dir, *self.clips_dirs)

    @property
    def placeholders(self) -> dict[str, str]:
        """The values of placeholders, by name without ``@``."""
        return {name.strip("@"): folder for name, folder in self.substitutions.items()}

    @property
    def confdir(self) -> Path:
        """The base folder of relative paths in the configuration, Fawkes' ``@CONFDIR@``."""
        return self.checkouts.confdir(self.config_file)

    def expand(self, configured_path: str) -> list[Path]:
        """Return the folders of a path in the configuration, which may have placeholders, in search order."""
        return self.checkouts.expand(configured_path, self.placeholders, self.confdir)


def find_fawkes_interface_dirs(fawkes: Path) -> list[Path]:
    """Return the folders of interface definitions in a Fawkes checkout.

    :raises CxbridgeError: unless the folder is a Fawkes checkout.
    """
    return [find_fawkes_folder(fawkes, FAWKES_INTERFACES), *sorted(fawkes.glob(FAWKES_PLUGIN_INTERFACES))]


def find_fawkes_folder(fawkes: Path, path: str) -> Path:
    """Return a folder of a Fawkes checkout.

    :param path: the folder, relative to the checkout.
    :raises CxbridgeError: if the checkout lacks the folder.
    """
    if not (fawkes / path).is_dir():
        raise CxbridgeError(
            f"this is not a Fawkes checkout: it has no {path}",
            file=fawkes,
            hint="name the top folder of a clone of the Fawkes repository",
        )
    return fawkes / path
