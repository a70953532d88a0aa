"""A checkout of the ROS 2 executive as the source of an agent: files, features, rate, skill board."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError
from cxbridge.executive.executive import BUILTIN_CX, CoreFiles
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.features.config import ConfigFeature, RedefineWarningFeature
from cxbridge.executive.manager import HOST_LIBRARY
from cxbridge.resources import shipped_dir
from cxbridge.run.paths import RunPaths
from cxbridge.run.source import Source
from cxbridge.skiller.board.settings import BoardSettings
from cxbridge_ros2cx.checkout import ROS2CX_CLIPS, ROS2CX_SANE_CLIPS, Ros2CxCheckout
from cxbridge_ros2cx.checks import check_parameters
from cxbridge_ros2cx.confvals import CONFIG_FEATURE
from cxbridge_ros2cx.features import REDEFINE_FEATURE, make_features
from cxbridge_ros2cx.original_board import board_class_of, with_idle_time
from cxbridge_ros2cx.parameters import EXECUTIVE_FILE, load_features, load_parameters, refresh_period_us
from cxbridge_ros2cx.refresh import RefreshTimer, seconds_and_nanoseconds
from cxbridge_ros2cx.settings import Ros2CxSettings
from cxbridge_ros2cx.skills import Ros2CxSkills

if TYPE_CHECKING:
    from cxbridge.clock import Clock
    from cxbridge.executive.executive import Executive
    from cxbridge.run.agent import Run
    from cxbridge.skiller.board.board import SkillBoard
    from cxbridge.skiller.board.service import SkillBoardService

# Configurations for `--config NAME` on top of a checkout's parameters.
OVERLAYS: Final = Path(__file__).parent / "overlays"


class Ros2CxSource(Source):
    """A checkout of ros2-clips-executive (2021), given with ``--ros2cx``."""

    has_fawkes_configuration = False

    _refresh: RefreshTimer | None = None
    _skills: tuple[SkillBoardService, Ros2CxSkills] | None = None

    @property
    def needs_skiller(self) -> bool:
        """Whether an action may go to a Skiller; without executors and configuration, all go to dummies."""
        return bool(self.options.option("executors") or self.options.config)

    @property
    def _checkout(self) -> Ros2CxCheckout:
        return Ros2CxCheckout.open(self.options.option("ros2cx"))

    def check(self) -> None:
        """Raise :class:`CxbridgeError` if another option conflicts with ``--ros2cx``."""
        self.check_folders()
        options = self.options
        if options.core == "fawkes":
            raise CxbridgeError(
                "--core fawkes cannot go with --ros2cx",
                hint="without --core the checkout's own core is used, with --core builtin ours",
            )
        if options.scenario is not None or options.fawkes_dir is not None:
            raise CxbridgeError(
                "--ros2cx goes with neither a scenario nor --fawkes-dir",
                hint="its own parameter files are the configuration; lay another one over them with --config",
            )
        if not self.needs_skiller and options.skiller not in ("lua", "none"):
            raise CxbridgeError(
                f"--skiller {options.skiller} cannot go with --ros2cx: its actions go to executors",
                hint="name an executor that sends skill strings to it, with --executor or in --config",
            )
        if options.overlays:
            raise CxbridgeError("--overlay goes with Fawkes' layout only, not with --ros2cx")

    @property
    def folders(self) -> tuple[Path, ...]:
        return (self.options.option("ros2cx"),)

    @property
    def is_checkout(self) -> bool:
        return True

    def config_file(self) -> Path:
        return self._checkout.parameters / EXECUTIVE_FILE

    def read_configuration(self, file: Path) -> Configuration:
        return load_parameters(file.parent)

    def find_overlays(self) -> Sequence[Path]:
        """Return the overlays; a bare name may refer to a shipped overlay."""
        return tuple(map(_find_overlay, super().find_overlays()))

    def find_paths(self, config: Configuration, config_file: Path) -> RunPaths:
        """Return the files and folders of the checkout."""
        checkout, options = self._checkout, self.options
        configured = config.get_strings("/clips-executive/clips-dirs", default=[])
        # an unknown placeholder is kept, as in the original: such a folder holds nothing
        folders = [
            *options.clips_dirs,
            *(Path(text.replace("@CONFDIR@", str(checkout.bringup))) for text in configured),
        ]
        folders.append(OVERLAYS)  # the files that shipped overlays load
        is_builtin = options.core == "builtin"
        early_clips: tuple[Path, ...] = () if Ros2CxSettings.of(config).original else (ROS2CX_SANE_CLIPS,)
        if is_builtin:
            folders.append(checkout.core)  # the agents are in the core's folder
        return RunPaths(
            config_file=config_file,
            library=HOST_LIBRARY if is_builtin else checkout.library,
            cx=BUILTIN_CX if is_builtin else checkout.core,
            before=(ROS2CX_CLIPS, ROS2CX_SANE_CLIPS) if is_builtin else early_clips,
            clips_dirs=tuple(dict.fromkeys(folders)),
            interface_dirs=(*options.interface_dirs, shipped_dir("interfaces")),
            skill_dirs=(*options.skill_dirs, shipped_dir("luaskills")),
            substitutions={"@CONFDIR@": str(checkout.bringup)},
        )

    def find_oddities(self, config: Configuration, spec: str) -> list[str]:
        """Return warnings about the parameters and the checkout."""
        return check_parameters(config, spec, self._checkout)

    def loop_period_us(self, config: Configuration) -> int:
        """Return the duration of a main loop, short enough for the executive's rate."""
        return min(super().loop_period_us(config), refresh_period_us(config))

    def board_settings(self, settings: BoardSettings | None, config: Configuration) -> BoardSettings:
        return with_idle_time(settings or BoardSettings(), config)

    def board_class(self, config: Configuration) -> type[SkillBoard]:
        return board_class_of(config)

    def prepare_board(self, context: Run) -> None:
        """Add the executors of ``--executor``."""
        for text in self.options.option("executors"):
            skills = self._skills_of(context)
            assert skills is not None  # the run has a board, which calls this method
            skills.add_executor(text)

    def _skills_of(self, context: Run) -> Ros2CxSkills | None:
        """Return the executive's interface to the skill board; None while the run has no board."""
        service = context.skill_service
        if service is None:
            return None
        if self._skills is None or self._skills[0] is not service:
            assert context.skill_board is not None  # a board has settings
            settings = Ros2CxSettings.of(context.config)
            skills = Ros2CxSkills(
                service,
                context.board,
                context.clock,
                context.bus,
                context.skill_board,
                original=settings.original,
                unsensed=settings.unsensed,
            )
            self._skills = service, skills
        return self._skills[1]

    def features(self, context: Run) -> list[Feature]:
        """Return the features of the parameter files."""
        folder = self._checkout.parameters
        blocks = iter(Ros2CxSettings.of(context.config).removal_blocks)

        def on_removal() -> None:
            if self._refresh is not None:
                self._refresh.block(next(blocks, 0.0))

        features = make_features(
            load_features(folder),
            context.config,
            folder,
            context.board,
            lambda: self._skills_of(context),
            on_removal,
            context.make_planning,
        )
        if not context.paths.builtin:
            return features
        builtin_features = [
            BlackBoardFeature(context.board),
            ConfigFeature(context.config),
            RedefineWarningFeature(),
        ]
        # a feature of the checkout replaces the built-in one of its name
        names = {feature.name for feature in features}
        return [*(feature for feature in builtin_features if feature.name not in names), *features]

    def core_files(self, paths: RunPaths, config: Configuration) -> CoreFiles:
        """Return the executive's files, with the features of the checkout's own core."""
        files = super().core_files(paths, config)
        if paths.builtin:
            return files
        time_of = seconds_and_nanoseconds if Ros2CxSettings.of(config).original else files.time_of
        return CoreFiles(
            files.cx,
            files.clips_dirs,
            files.substitutions,
            files.before,
            config_feature=CONFIG_FEATURE,
            redefine_feature=REDEFINE_FEATURE,
            time_of=time_of,
        )

    def start_thinking(self, clock: Clock, config: Configuration) -> None:
        """Start the timer of the executive."""
        self._refresh = RefreshTimer(clock, refresh_period_us(config))

    def think(self, executive: Executive) -> int:
        """Run the rules when the timer is due, or at once to resume a stopped run."""
        if self._refresh is None or executive.within_loop:
            return executive.loop()
        fired = 0
        while self._refresh.due():
            fired += executive.loop()
        return fired


def _find_overlay(file: Path) -> Path:
    if file.exists() or len(file.parts) != 1 or file.suffix:
        return file
    overlay = OVERLAYS / f"{file}.yaml"
    if not overlay.is_file():
        names = ", ".join(path.stem for path in sorted(OVERLAYS.glob("*.yaml")))
        raise CxbridgeError(
            "there is no such configuration", file=file, hint=f"shipped with cxbridge: {names}"
        )
    return overlay
