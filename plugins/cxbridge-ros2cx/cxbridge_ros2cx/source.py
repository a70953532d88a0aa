"""A checkout of the thesis' executive, ros2-clips-executive (2021), as the source of an agent.

The source reads the parameter files of the checkout as the configuration, finds the CLIPS files of core and
agents, makes the features that the parameters list, connects the skill board, and runs the rules at the
configured rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from msgspec.structs import replace

from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError
from cxbridge.executive.executive import CoreFiles
from cxbridge.executive.feature import Feature
from cxbridge.resources import shipped_dir
from cxbridge.run.paths import RunPaths
from cxbridge.run.source import Source
from cxbridge.skiller.board.settings import BoardSettings
from cxbridge_planning.feature.base import service_maker
from cxbridge_planning.settings import PlannerSettings
from cxbridge_ros2cx.checkout import ROS2CX_SANE_CLIPS, Ros2CxCheckout
from cxbridge_ros2cx.checks import find_unknown_keys
from cxbridge_ros2cx.confvals import CONFIG_FEATURE
from cxbridge_ros2cx.features import REDEFINE_FEATURE, make_features
from cxbridge_ros2cx.parameters import (
    EXECUTIVE_FILE,
    load_executive_parameters,
    load_feature_entries,
    read_refresh_period_us,
)
from cxbridge_ros2cx.refresh import RefreshTimer, to_seconds_and_nanoseconds
from cxbridge_ros2cx.settings import Ros2CxSettings
from cxbridge_ros2cx.skill_board_client import SkillBoardClient
from cxbridge_ros2cx.thesis_board import add_response_timeout, select_board_class

if TYPE_CHECKING:
    from cxbridge.clock import Clock
    from cxbridge.executive.executive import Executive
    from cxbridge.run.agent import Run
    from cxbridge.skiller.board.board import SkillBoard
    from cxbridge.skiller.board.executor import SkillExecutor
    from cxbridge.skiller.board.service import SkillBoardService

# shipped configurations, which `--config NAME` lays over the parameters of a checkout
OVERLAYS_DIR: Final = Path(__file__).parent / "overlays"


class Ros2CxSource(Source):
    """A checkout of ros2-clips-executive (2021), given with ``--ros2cx``."""

    has_fawkes_configuration = False

    _refresh_timer: RefreshTimer | None = None
    _board_client: SkillBoardClient | None = None
    # the service of `_board_client`: a restarted component of a daemon has a new service, so it needs a new
    # client
    _skill_service: SkillBoardService | None = None

    @property
    def needs_skiller(self) -> bool:
        """Whether an executor may use a Skiller; without ``--executor`` and ``--config``, all are dummies."""
        return bool(self.options.option("executors") or self.options.config)

    @property
    def _checkout(self) -> Ros2CxCheckout:
        return Ros2CxCheckout.open(self.options.option("ros2cx"))

    def check(self) -> None:
        """Check that no other option conflicts with ``--ros2cx``.

        :raises CxbridgeError: if an option conflicts, or the checkout does not exist.
        """
        self.check_folders()
        options = self.options
        if options.core is not None:
            raise CxbridgeError(
                "--core cannot be combined with --ros2cx", hint="omit --core: the checkout has its own core"
            )
        if options.scenario is not None or options.fawkes_dir is not None:
            raise CxbridgeError(
                "--ros2cx cannot be combined with a scenario or --fawkes-dir",
                hint="the checkout has its own configuration; lay a file over it with --config",
            )
        if not self.needs_skiller and options.skiller not in ("lua", "none"):
            raise CxbridgeError(
                f"--skiller {options.skiller} cannot be combined with --ros2cx: actions go to executors",
                hint="name an executor that sends skill strings to a Skiller, with --executor or --config",
            )
        if options.overlays:
            raise CxbridgeError("--overlay requires Fawkes' layout, so it cannot be combined with --ros2cx")

    @property
    def folders(self) -> tuple[Path, ...]:
        return (self.options.option("ros2cx"),)

    @property
    def is_checkout(self) -> bool:
        return True

    def config_file(self) -> Path:
        return self._checkout.parameter_folder / EXECUTIVE_FILE

    def read_configuration(self, file: Path) -> Configuration:
        return load_executive_parameters(file.parent)

    def find_overlays(self) -> Sequence[Path]:
        """Return the overlays; a name without a folder and a suffix may be that of a shipped overlay.

        :raises CxbridgeError: if there is no shipped overlay of such a name.
        """
        return tuple(map(_find_overlay, super().find_overlays()))

    def find_paths(self, config: Configuration, config_file: Path) -> RunPaths:
        """Return the files and folders of the checkout."""
        checkout, options = self._checkout, self.options
        configured_folders = config.get_strings("/clips-executive/clips-dirs", default=[])
        folders = (
            *options.clips_dirs,
            *(
                Path(folder.replace("@CONFDIR@", str(checkout.bringup_folder)))
                for folder in configured_folders
            ),
            OVERLAYS_DIR,  # the files that shipped overlays load
        )
        repeats_defects = Ros2CxSettings.from_config(config).repeats_defects
        return RunPaths(
            config_file=config_file,
            library_dir=checkout.library_folder,
            core_dir=checkout.core_folder,
            override_dirs=() if repeats_defects else (ROS2CX_SANE_CLIPS,),
            clips_dirs=tuple(dict.fromkeys(folders)),
            interface_dirs=(*options.interface_dirs, shipped_dir("interfaces")),
            skill_dirs=(*options.skill_dirs, shipped_dir("luaskills")),
            substitutions={"@CONFDIR@": str(checkout.bringup_folder)},
        )

    def choose_spec(self, config: Configuration, config_file: Path) -> tuple[str, list[str]]:
        """Return the spec, and warnings about the parameters."""
        spec, warnings = super().choose_spec(config, config_file)
        return spec, [*warnings, *find_unknown_keys(config, spec)]

    def loop_period_us(self, config: Configuration) -> int:
        """Return the duration of a main loop, which is at most the time between two runs of the rules."""
        return min(super().loop_period_us(config), read_refresh_period_us(config))

    def board_settings(
        self, config: Configuration, paths: RunPaths, executors: tuple[type[SkillExecutor], ...] = ()
    ) -> BoardSettings:
        return add_response_timeout(
            super().board_settings(config, paths, executors) or BoardSettings(), config
        )

    def board_class(self, config: Configuration) -> type[SkillBoard]:
        return select_board_class(config)

    def prepare_board(self, context: Run) -> None:
        """Add the executors of ``--executor``."""
        for executor_option in self.options.option("executors"):
            board_client = self._ensure_board_client(context)
            assert board_client is not None  # this method is only called for a run with a board
            board_client.add_executor(executor_option)

    def _ensure_board_client(self, context: Run) -> SkillBoardClient | None:
        """Return the client of the skill board, made at the first call; None while the run has no board."""
        service = context.skill_service
        if service is None:
            return None
        if self._board_client is None or self._skill_service is not service:
            assert context.skill_board is not None  # the settings of the board, which a run with a board has
            settings = Ros2CxSettings.from_config(context.config)
            self._skill_service = service
            self._board_client = SkillBoardClient(service, context, context.skill_board, settings)
        return self._board_client

    def features(self, context: Run) -> list[Feature]:
        """Return the features of the parameter files."""
        # the thesis' executive blocks while it removes an ended skill: each removal takes the next duration
        block_times_s = iter(Ros2CxSettings.from_config(context.config).removal_block_times_s)

        def record_blocking() -> None:
            if self._refresh_timer is not None:
                self._refresh_timer.record_blocking(next(block_times_s, 0.0))

        return make_features(
            load_feature_entries(self._checkout.parameter_folder),
            context.config,
            context.board,
            lambda: self._ensure_board_client(context),
            record_blocking,
            service_maker(context, PlannerSettings.from_config(context.config)),
        )

    def core_files(self, paths: RunPaths, config: Configuration) -> CoreFiles:
        """Return the executive's files, with the features of the checkout's core."""
        files = super().core_files(paths, config)
        files = replace(files, config_feature=CONFIG_FEATURE, redefine_feature=REDEFINE_FEATURE)
        if Ros2CxSettings.from_config(config).repeats_defects:
            files = replace(files, to_time_fields=to_seconds_and_nanoseconds)
        return files

    def start_thinking(self, clock: Clock, config: Configuration) -> None:
        self._refresh_timer = RefreshTimer(clock, read_refresh_period_us(config))

    def think(self, executive: Executive) -> int:
        """Run the rules as often as the timer is due, and return the number of firings.

        A run that the debugger has stopped resumes at once.
        """
        if self._refresh_timer is None or executive.is_within_loop:
            return executive.loop()
        fired_count = 0
        while self._refresh_timer.advance_if_due():
            fired_count += executive.loop()
        return fired_count


def _find_overlay(file: Path) -> Path:
    """Return the shipped overlay of a name, unless a file has this name; return other paths unchanged.

    :param file: a name if it has neither a folder nor a suffix.
    :raises CxbridgeError: if there is neither a file nor a shipped overlay of a name.
    """
    if file.exists() or len(file.parts) != 1 or file.suffix:
        return file
    overlays = {path.stem: path for path in sorted(OVERLAYS_DIR.glob("*.yaml"))}
    if str(file) not in overlays:
        raise CxbridgeError(
            "there is no such configuration", file=file, hint=f"shipped with cxbridge: {', '.join(overlays)}"
        )
    return overlays[str(file)]
