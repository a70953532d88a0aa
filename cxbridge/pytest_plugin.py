"""The pytest plug-in: fixtures for runs of agents, golden runs, reports of failures. See docs/testing.md."""

from __future__ import annotations

import re
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from types import TracebackType

    from cxbridge.testing.agent_run import AgentRun

_RUN_MAKER_KEY: pytest.StashKey[RunMaker] = pytest.StashKey()
_FAILED_KEY: pytest.StashKey[bool] = pytest.StashKey()
_SCRIPTED = "scripted"
Paths = str | Path | tuple[str | Path, ...]
"""One configuration file, or several."""
# the name of a module of cxbridge, or of a plug-in in its repository
_LIBRARY_MODULE = re.compile(r"cxbridge(_\w+)?(\.|$)")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("cxbridge", "agents of the CLIPS Executive")
    group.addoption("--update-golden", action="store_true", help="write the golden files of runs again")
    group.addoption(
        "--cx-artifacts", metavar="DIR", help="keep the recorded runs of failed tests in this folder"
    )


@dataclass
class RunMaker:
    """The maker of runs for a test (fixture ``cx``) or for all tests of a module (fixture ``cx_module``).

    :param test_file: the file of the test.
    :param test_name: the name of the test; empty if all tests of a module share the runs.
    :param root_dir: pytest's root folder.
    :param update_golden: whether to write the golden files instead of comparing.
    :param artifact_dir: the folder for recordings of failed tests; None: no recordings.
    :param runs: the open runs, in the order of their creation.
    """

    test_file: Path
    test_name: str
    root_dir: Path
    update_golden: bool = False
    artifact_dir: Path | None = None
    runs: list[AgentRun] = field(default_factory=list)

    def run(
        self,
        scenario: str | Path | None = None,
        *,
        skiller: str = _SCRIPTED,
        strict: bool = True,
        patience: float | None = None,
        config: Paths = (),
        **options: Any,
    ) -> AgentRun:
        """Make a run of a scenario and load its agent.

        :param scenario: the scenario as for ``cxbridge run``; None: no scenario, only ``options``.
        :param skiller: ``scripted``, or as for ``cxbridge run``.
        :param strict: whether mistakes in the loaded files raise an error.
        :param patience: the maximum duration of a wait, in seconds of real time; None: the default of
            :class:`~cxbridge.testing.agent_run.AgentRun`.
        :param config: files that are laid over the configuration in order.
        :param options: further options of ``cxbridge run``, e.g. ``spec``, ``clips_dirs``, ``fawkes_dir``,
            and of plug-ins, e.g. ``ros2cx``.
        :raises CxbridgeError: if the scenario is invalid.
        :raises AssertionError: if a construct does not load.
        """
        # imported on first use, because pytest loads this plug-in in every project of the machine
        from cxbridge.run.program.plain_options import options_from_keywords  # noqa: PLC0415
        from cxbridge.testing.agent_run import PATIENCE_S, AgentRun  # noqa: PLC0415
        from cxbridge.testing.golden import GoldenFiles, portable_file_name  # noqa: PLC0415

        trace = None
        if self.artifact_dir is not None:
            name = portable_file_name(self.test_name or "module") + (
                f"-{len(self.runs) + 1}" if self.runs else ""
            )
            trace = self.artifact_dir / self.test_file.stem / f"{name}.mcap"
        run_options = options_from_keywords(
            scenario,
            resolve_path=self.find,
            config=config,
            skiller="none" if skiller == _SCRIPTED else skiller,
            trace=trace,
            trace_level="facts" if trace is not None else "rules",
            **options,
        )
        run_options.check()
        run = AgentRun(
            run_options,
            scripted=skiller == _SCRIPTED,
            strict=strict,
            patience=patience or PATIENCE_S,
            golden=GoldenFiles(
                self.test_file.parent / "golden" / self.test_file.stem,
                self.test_name,
                is_update=self.update_golden,
                page_folder=None if self.artifact_dir is None else self.artifact_dir / self.test_file.stem,
            ),
        )
        self.runs.append(run)
        return run

    def __getattr__(self, name: str) -> Any:
        """Return a member of a plug-in, e.g. ``cx.explore`` of cxbridge-explore."""
        from cxbridge.testing.members import find_member  # noqa: PLC0415 - on first use, as in run

        return find_member("cx", self, name)

    def find(self, path: str | Path) -> Path:
        """Return a path within the test's folder, else within pytest's root, else unchanged."""
        candidates = (self.test_file.parent / path, self.root_dir / path)
        return next((candidate for candidate in candidates if candidate.exists()), Path(path))

    def check_skills(self) -> None:
        """Fail the test if a scripted skill was never called, because its name may be wrong."""
        complaints = [line for run in self.runs for line in run.unmet_skills()]
        if complaints:
            pytest.fail("\n".join(complaints), pytrace=False)

    def close(self, *, failed: bool) -> None:
        """Close the runs; keep their recordings after a failure."""
        for run in self.runs:
            run.close()
            if run.options.trace is not None and not failed:
                run.options.trace.unlink(missing_ok=True)
        self.runs.clear()


def _open_run_maker(request: pytest.FixtureRequest, test_name: str) -> Iterator[RunMaker]:
    """Yield a maker of runs, and close its runs afterwards.

    :param test_name: the name of the test; empty if all tests of a module share the runs.
    """
    config = request.config
    artifact_dir = config.getoption("--cx-artifacts")
    run_maker = RunMaker(
        request.path,
        test_name,
        config.rootpath,
        update_golden=config.getoption("--update-golden"),
        artifact_dir=None if artifact_dir is None else Path(artifact_dir),
    )
    request.node.stash[_RUN_MAKER_KEY] = run_maker
    yield run_maker
    failed = request.node.stash.get(_FAILED_KEY, False)
    try:
        if not (test_name or failed):  # pytest_runtest_call has checked the run maker of a single test
            run_maker.check_skills()
    finally:
        run_maker.close(failed=failed)


@pytest.fixture
def cx(request: pytest.FixtureRequest) -> Iterator[RunMaker]:
    """Make runs of agents: ``run = cx.run("scenarios/courier")``."""
    yield from _open_run_maker(request, request.node.name)


@pytest.fixture(scope="module")
def cx_module(request: pytest.FixtureRequest) -> Iterator[RunMaker]:
    """Make runs shared by all tests of a module, for fixtures of scope ``module``."""
    yield from _open_run_maker(request, "")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """Fail a test whose script of skills has unused entries."""
    yield
    run_maker = item.stash.get(_RUN_MAKER_KEY, None)
    if run_maker is not None:
        run_maker.check_skills()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Report the runs of a failed test."""
    if call.excinfo is not None and not item.config.getoption("fulltrace"):
        _remove_library_frames(call.excinfo)
    report = yield
    # when a teardown fails, the runs are closed already
    if not report.failed or call.when == "teardown":
        return report
    for node in item.listchain():
        run_maker = node.stash.get(_RUN_MAKER_KEY, None)
        # the runs of a module are only reported with the tests that use them
        if run_maker is None or (node is not item and "cx_module" not in getattr(item, "fixturenames", ())):
            continue
        node.stash[_FAILED_KEY] = True
        for number, run in enumerate(run_maker.runs, start=1):
            lines = run.describe()
            if run.options.trace is not None:
                lines.append(f"recorded: {run.options.trace}")
            report.sections.append((f"cxbridge run {number}", "\n".join(lines)))
    return report


def _remove_library_frames(excinfo: pytest.ExceptionInfo[BaseException]) -> None:
    """Remove the library's frames from a failure of the test; faults of the library keep all frames."""
    frames: list[TracebackType] = []
    traceback: TracebackType | None = excinfo.tb
    while traceback is not None:
        frames.append(traceback)
        traceback = traceback.tb_next
    test_frames = [
        frame for frame in frames if not _LIBRARY_MODULE.match(frame.tb_frame.f_globals.get("__name__", ""))
    ]
    if len(test_frames) == len(frames):
        return
    from cxbridge.errors import CxbridgeError  # noqa: PLC0415 - on first use, as in run

    if test_frames and test_frames[0] is frames[0] and excinfo.errisinstance((AssertionError, CxbridgeError)):
        # pytest shows the traceback's own chain, so the chain itself must change
        for frame, next_frame in zip(test_frames, (*test_frames[1:], None), strict=True):
            frame.tb_next = next_frame
