"""What a run can be told."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cxbridge.errors import CxbridgeError

CORES = ("builtin", "fawkes")
SKILLERS = ("lua", "simulator", "none")
SPEECH = ("off", "on")
TRACE_LEVELS = ("transitions", "rules", "facts")


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """The options of ``cxbridge run``; see its help.

    :param timeout: seconds of the run's clock.
    """

    scenario: Path | None = None
    spec: str | None = None
    config: Path | None = None
    fawkes_dir: Path | None = None
    core: str | None = None
    clips_dirs: tuple[Path, ...] = ()
    interface_dirs: tuple[Path, ...] = ()
    skill_dirs: tuple[Path, ...] = ()
    clock: str = "virtual"
    skiller: str = "lua"
    speech: str = "off"
    timeout: float = 600.0
    trace: Path | None = None
    trace_level: str = "transitions"
    log: Path | None = None
    bblog: Path | None = None
    strict: bool = False

    def check(self) -> None:
        """Raise :class:`CxbridgeError` when an option's value is none of those it can have."""
        for name, value, known in (
            ("core", self.core, (None, *CORES)),
            ("skiller", self.skiller, SKILLERS),
            ("speech", self.speech, SPEECH),
            ("trace-level", self.trace_level, TRACE_LEVELS),
        ):
            if value not in known:
                names = ", ".join(item for item in known if item)
                raise CxbridgeError(f"--{name} cannot be '{value}'", hint=f"use one of: {names}")
        if not self.timeout > 0:
            raise CxbridgeError(f"--timeout cannot be {self.timeout:g}", hint="use seconds, more than 0")
        if self.scenario is None and self.fawkes_dir is None:
            raise CxbridgeError(
                "no scenario given",
                hint="name a folder with a scenario.yaml, or a Fawkes checkout with --fawkes-dir",
            )
        folders = (*self.clips_dirs, *self.interface_dirs, *self.skill_dirs)
        for folder in folders if self.fawkes_dir is None else (*folders, self.fawkes_dir):
            if not folder.is_dir():
                raise CxbridgeError("there is no such folder", file=folder)
