"""The paths of the files of a run, from its scenario and, if there is one, a Fawkes checkout."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from msgspec import Struct

from cxbridge.config import Configuration
from cxbridge.config.checkouts import Checkouts
from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.executive.executive import BUILTIN_CX
from cxbridge.executive.manager import HOST_LIBRARY
from cxbridge.resources import shipped_dir, shipped_scenarios
from cxbridge.ros2cx.checkout import ROS2CX_CLIPS, ROS2CX_SANE_CLIPS, Ros2CxCheckout
from cxbridge.ros2cx.parameters import EXECUTIVE_FILE
from cxbridge.ros2cx.settings import Ros2CxSettings
from cxbridge.run.options import RunOptions
from cxbridge.run.specs import check_files

SCENARIO_FILE = "scenario.yaml"
_OVERLAYS = "ros2cx"
"""Below the shipped scenarios: configurations for the executive for ROS 2, to be laid over its own."""
_MOST_NAMED = 3  # scenarios, in a hint

_FAWKES_LIBRARY = "src/plugins/clips/clips"
_FAWKES_CX = "src/plugins/clips-executive/clips"
_FAWKES_ROBOT_MEMORY = "src/plugins/clips-robot-memory/robot-memory.clp"
_FAWKES_INTERFACES = "src/libs/interfaces"
_FAWKES_PLUGIN_INTERFACES = "src/plugins/*/interfaces"
_FAWKES_LUA = "src/lua"
_OWN_INTERFACES = "interfaces"  # of a scenario, beside its scenario.yaml


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
    :param ros2cx: the checkout of ros2-clips-executive whose features the agent needs.
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
    ros2cx: Ros2CxCheckout | None = None
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


def find_checkouts(options: RunOptions) -> Checkouts:
    """Return the checkouts that the options name, in the order they are searched."""
    fawkes = () if options.fawkes_dir is None else (options.fawkes_dir,)
    return Checkouts(tuple(folder.resolve() for folder in (*options.overlays, *fawkes)))


def find_config_file(options: RunOptions) -> Path:
    """Return the configuration file that the options name.

    :raises CxbridgeError: when there is none.
    """
    if options.ros2cx is not None:
        return Ros2CxCheckout.open(options.ros2cx).parameters / EXECUTIVE_FILE
    checkouts = find_checkouts(options)
    named = options.scenario
    if named is None:
        assert checkouts.folders  # options.check() has seen to it
        named = checkouts.find_configuration(Path())
    if not named.exists():
        named = checkouts.find_configuration(named)
    if not named.exists() and len(named.parts) == 1 and (shipped_dir("scenarios") / named).is_dir():
        named = shipped_dir("scenarios") / named
    if named.is_dir():
        for name in (SCENARIO_FILE, "config.yaml"):
            if (named / name).is_file():
                return named / name
        below = sorted(path.parent for path in named.glob(f"*/{SCENARIO_FILE}"))[:_MOST_NAMED]
        raise CxbridgeError(
            "this folder has no scenario.yaml and no config.yaml",
            file=named,
            hint=f"did you mean {' or '.join(map(str, below))}?"
            if below
            else "name a scenario's folder, or a Fawkes configuration file or folder",
        )
    if not named.is_file():
        shipped = ", ".join(shipped_scenarios())
        raise CxbridgeError("there is no such scenario", file=named, hint=f"shipped with cxbridge: {shipped}")
    return named


def find_overlays(files: Path | Sequence[Path] | None, *, ros2cx: bool) -> tuple[Path, ...]:
    """Return the configuration files that are laid over the others.

    :param ros2cx: whether a name alone may stand for one that is shipped for the executive for ROS 2.
    :raises CxbridgeError: when there is none of that name.
    """
    given = (files,) if isinstance(files, Path) else tuple(files or ())
    return tuple(map(_find_overlay, given)) if ros2cx else given


def _find_overlay(file: Path) -> Path:
    if file.exists() or len(file.parts) != 1 or file.suffix:
        return file
    folder = shipped_dir("scenarios") / _OVERLAYS
    shipped = folder / f"{file}.yaml"
    if not shipped.is_file():
        names = ", ".join(path.stem for path in sorted(folder.glob("*.yaml")))
        raise CxbridgeError(
            "there is no such configuration", file=file, hint=f"shipped with cxbridge: {names}"
        )
    return shipped


def find_paths(options: RunOptions, config: Configuration, config_file: Path) -> RunPaths:
    """Find everything that the options and the configuration name."""
    if options.ros2cx is not None:
        return _ros2cx_paths(Ros2CxCheckout.open(options.ros2cx), options, config, config_file)
    checkouts = find_checkouts(options)
    here = checkouts.confdir(config_file).resolve()
    fawkes = options.fawkes_dir.resolve() if options.fawkes_dir else None
    base = checkouts.base(config_file)
    placeholders = {
        "BASEDIR": str(base),
        "FAWKES_BASEDIR": str(fawkes or base),
        "RESDIR": str(base / "res"),
        "CONFDIR": str(here),
    }
    use_fawkes_core = (options.core or ("fawkes" if fawkes else "builtin")) == "fawkes"
    if use_fawkes_core and fawkes is None:
        raise CxbridgeError("--core fawkes needs a Fawkes checkout", hint="name it with --fawkes-dir")
    cx, library, robot_memory = BUILTIN_CX, HOST_LIBRARY, None
    clips_dirs = [*options.clips_dirs]
    for text in config.get_strings("/clips-executive/clips-dirs", default=[]):
        clips_dirs += checkouts.expand(text, placeholders, here)
    overlays = Checkouts(checkouts.folders[: len(options.overlays)])
    interface_dirs = [*options.interface_dirs, *overlays.parts(_FAWKES_INTERFACES)]
    interface_dirs += overlays.parts(_FAWKES_PLUGIN_INTERFACES)
    skill_dirs = [*options.skill_dirs, *overlays.parts(_FAWKES_LUA)]
    if config_file.name == SCENARIO_FILE:
        clips_dirs.append(here)
        if (here / _OWN_INTERFACES).is_dir():
            interface_dirs.append(here / _OWN_INTERFACES)
    if fawkes is not None:
        fawkes_cx = _needed(fawkes, _FAWKES_CX)
        interface_dirs += fawkes_interface_dirs(fawkes)
        skill_dirs.append(_needed(fawkes, _FAWKES_LUA))
        if use_fawkes_core:
            cx, library = fawkes_cx, _needed(fawkes, _FAWKES_LIBRARY)
            robot_memory = fawkes / _FAWKES_ROBOT_MEMORY
        else:
            # the original agents are in the core's folder
            clips_dirs.append(fawkes_cx)
    return RunPaths(
        config_file=config_file,
        library=library,
        cx=cx,
        clips_dirs=tuple(dict.fromkeys(clips_dirs)),
        interface_dirs=(*interface_dirs, shipped_dir("interfaces")),
        skill_dirs=(*skill_dirs, shipped_dir("luaskills")),
        substitutions={f"@{name}@": folder for name, folder in placeholders.items()},
        robot_memory=robot_memory,
        checkouts=checkouts,
    )


def find_missing(config: Configuration, spec: str, paths: RunPaths) -> list[ConfigError]:
    """Return the files that a spec wants to load and that are not there, each with its place."""
    return check_files(config, spec, (*paths.before, paths.cx, *paths.clips_dirs))


def check_paths(config: Configuration, spec: str, paths: RunPaths) -> list[str]:
    """Return what is strange about the files of a run, but no error: each with its place."""
    if paths.ros2cx is None:
        return []
    from cxbridge.ros2cx.checks import check_parameters  # noqa: PLC0415 - start-up time is a feature

    return check_parameters(config, spec, paths.ros2cx)


def _ros2cx_paths(
    checkout: Ros2CxCheckout, options: RunOptions, config: Configuration, config_file: Path
) -> RunPaths:
    """Return where a checkout of the executive for ROS 2 has its files."""
    placeholders = {"CONFDIR": str(checkout.bringup)}
    configured = config.get_strings("/clips-executive/clips-dirs", default=[])
    # a placeholder that nobody knows stays as it is, as in the original: such a folder holds nothing
    folders = [
        *options.clips_dirs,
        *(Path(text.replace("@CONFDIR@", str(checkout.bringup))) for text in configured),
    ]
    folders.append(shipped_dir("scenarios") / _OVERLAYS)  # what shipped configurations load
    builtin = options.core == "builtin"
    before: tuple[Path, ...] = () if Ros2CxSettings.of(config).original else (ROS2CX_SANE_CLIPS,)
    if builtin:
        folders.append(checkout.core)  # the agents are in the core's folder
    return RunPaths(
        config_file=config_file,
        library=HOST_LIBRARY if builtin else checkout.library,
        cx=BUILTIN_CX if builtin else checkout.core,
        before=(ROS2CX_CLIPS, ROS2CX_SANE_CLIPS) if builtin else before,
        clips_dirs=tuple(dict.fromkeys(folders)),
        interface_dirs=(*options.interface_dirs, shipped_dir("interfaces")),
        skill_dirs=(*options.skill_dirs, shipped_dir("luaskills")),
        substitutions={f"@{name}@": folder for name, folder in placeholders.items()},
        ros2cx=checkout,
    )


def fawkes_interface_dirs(fawkes: Path) -> list[Path]:
    """Return where a Fawkes checkout has its interface definitions.

    :raises CxbridgeError: when it is none.
    """
    return [_needed(fawkes, _FAWKES_INTERFACES), *sorted(fawkes.glob(_FAWKES_PLUGIN_INTERFACES))]


def _needed(fawkes: Path, part: str) -> Path:
    """Return a part of a Fawkes checkout that must be there."""
    if not (fawkes / part).is_dir():
        raise CxbridgeError(
            f"this is not a Fawkes checkout: it has no {part}",
            file=fawkes,
            hint="name the top folder of a clone of the Fawkes repository",
        )
    return fawkes / part
