"""The files of ``run --bblog`` compared with those of Fawkes, and the run with and without the recorder."""

from __future__ import annotations

import itertools
import signal
import struct
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from cxbridge.interfaces.registry import default_registry
from cxbridge.run import RunOptions, run_scenario
from tests.programs import Started
from tests.run.mini import AGENT, write_scenario
from tests.support import ROOT, SHARED, needs_shared

TEST_SCENARIO = ROOT / "scenarios" / "test-scenario"
RECORDINGS = SHARED / "traces" / "test-scenario"
STAMP = "2001-09-09-01-46-40"
SKILLER, SPEECH = "SkillerInterface-Skiller", "SpeechSynthInterface-Flite"
DEBUG = "SkillerDebugInterface-Skiller"


def check_as_fawkes_does(path: Path) -> tuple[int, int]:
    """Check a file in the order of Fawkes' reader; return the count and the size of its blocks.

    The flag for the byte order must be that of a little-endian host.
    """
    head = path.read_bytes()[:196]
    magic, version = struct.unpack_from(">II", head)
    order, count = struct.unpack_from("<II", head, 8)
    size, start, start_us = struct.unpack_from("<Iqq", head, 176)
    assert (magic, version) == (0xFFBBFFBB, 1)
    assert count != 0
    assert path.stat().st_size == 196 + count * (8 + size)
    assert order == 0
    assert start > 0
    assert 0 <= start_us < 1_000_000
    return count, size


def blocks(path: Path) -> list[bytes]:
    """Return the blocks of a file."""
    count, size = check_as_fawkes_does(path)
    data = path.read_bytes()[196:]
    return [data[at + 8 : at + 8 + size] for at in range(0, count * (8 + size), 8 + size)]


def zero_fields(kind: str, block: bytes, *fields: str) -> bytes:
    """Return a block with zeros in its time stamp and ``fields``."""
    kept = bytearray(block)
    kept[:16] = bytes(16)
    for name in fields:
        field = default_registry().schema(kind).field(name)
        assert field is not None
        kept[field.offset : field.offset + field.size] = bytes(field.size)
    return bytes(kept)


def record(folder: Path, skiller: str = "lua", clock: str = "virtual") -> Path:
    options = RunOptions(scenario=TEST_SCENARIO, skiller=skiller, clock=clock, bblog=folder)
    assert run_scenario(options).status == 0
    return folder


@pytest.fixture(scope="module")
def log_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("bblog"))


def recorded(name: str, interface: str) -> Path:
    (path,) = (RECORDINGS / name / "bblogger-repaired").glob(f"*-{interface}-*.log")
    return path


def test_each_written_interface_has_file_for_fawkes_reader(log_folder: Path) -> None:
    counts = {path.name: check_as_fawkes_does(path)[0] for path in log_folder.iterdir()}
    assert counts == {
        f"test-{SKILLER}-{STAMP}.log": 9,
        f"test-{SPEECH}-{STAMP}.log": 8,
        f"test-{DEBUG}-{STAMP}.log": 9,
        f"test-{DEBUG}Layouted-{STAMP}.log": 9,
    }


@needs_shared
@pytest.mark.parametrize("interface", [SKILLER, SPEECH, DEBUG])
def test_headers_equal_recorded_hashes_and_sizes(log_folder: Path, interface: str) -> None:
    written, expected = (
        path.read_bytes()[:196]
        for path in (log_folder / f"test-{interface}-{STAMP}.log", recorded("skiller-1", interface))
    )
    assert written[:12] == expected[:12]
    assert written[48:180] == expected[48:180]  # type, id, hash, size


@needs_shared
@pytest.mark.parametrize(
    ("skiller", "name"), [("lua", "skiller-1"), ("lua", "skiller-2"), ("simulator", "simulator-1")]
)
def test_skiller_writes_recorded_blocks(tmp_path: Path, skiller: str, name: str) -> None:
    folder = record(tmp_path, skiller)
    written, expected = (
        [zero_fields("SkillerInterface", block, "exclusive_controller") for block in blocks(path)]
        for path in (folder / f"test-{SKILLER}-{STAMP}.log", recorded(name, SKILLER))
    )
    assert len(expected) == 9
    assert written == expected


@needs_shared
@pytest.mark.parametrize(
    ("interface", "field", "greetings"),
    [(SPEECH, "duration", 2), (DEBUG, "graph", 0)],
    ids=["speech", "debug"],
)
@pytest.mark.parametrize("name", ["skiller-1", "skiller-2"])
def test_run_writes_recorded_speech_and_graphs(
    log_folder: Path, name: str, interface: str, field: str, greetings: int
) -> None:
    """The duration of the speech and the graph of a different skill are left out.

    The recorded speech synthesis starts with a greeting.
    """
    written, expected = (
        [zero_fields(interface.partition("-")[0], block, field) for block in blocks(path)]
        for path in (log_folder / f"test-{interface}-{STAMP}.log", recorded(name, interface))
    )
    assert all(block[16:].startswith(b"Speech synth loaded") for block in expected[:greetings])
    assert written == expected[greetings:]


@pytest.mark.parametrize("clock", ["virtual", "scaled:20"])
def test_entry_times_follow_clock_of_run(tmp_path: Path, clock: str) -> None:
    (path,) = record(tmp_path, clock=clock).glob(f"*-{SKILLER}-*.log")
    data = path.read_bytes()
    start, start_us = struct.unpack_from("<qq", data, 180)
    zone = time.gmtime if clock == "virtual" else time.localtime
    assert path.name == f"test-{SKILLER}-{time.strftime('%Y-%m-%d-%H-%M-%S', zone(start))}.log"
    entries = [struct.unpack_from("<IIqq", data, at) for at in range(196, len(data), 8 + 1216)]
    assert len(entries) == 9
    entry_times = [seconds * 10**6 + us for seconds, us, _, _ in entries]
    stamps = [seconds * 10**6 + us - start * 10**6 - start_us for _, _, seconds, us in entries]
    assert all(earlier <= later for earlier, later in itertools.pairwise(entry_times))
    assert entry_times[-1] > 4_000_000
    # a block gets its time stamp before its entry; at the same time on the virtual clock
    max_delay = 0 if clock == "virtual" else 2_000_000
    assert all(
        0 <= entry_time - stamp <= max_delay for entry_time, stamp in zip(entry_times, stamps, strict=True)
    )


def test_two_runs_write_equal_bytes(tmp_path: Path) -> None:
    files_a, files_b = (
        {path.name: path.read_bytes() for path in record(tmp_path / folder).iterdir()} for folder in "ab"
    )
    assert files_a == files_b


# --- the run with and without the recorder ------------------------------------------------------------------

LOOK = """
(defrule look
  (declare (salience -100))
  (time $?)
  =>
  (blackboard-get-info)
  (delayed-do-for-all-facts ((?i blackboard-interface-info)) TRUE
    (printout t "info " ?i:type " " ?i:id " " ?i:has-writer " " ?i:num-readers " " ?i:writer " "
                (implode$ ?i:readers) crlf)))
"""


def test_recorder_changes_neither_log_nor_readers_of_run(tmp_path: Path) -> None:
    scenario = write_scenario(
        tmp_path / "s", agent=AGENT + LOOK, mapping="act: say{text=?(text)S, wait=true}"
    )
    logs = []
    for name, bblog in (("with", tmp_path / "bb"), ("without", None)):
        log = tmp_path / f"{name}.log"
        run_scenario(RunOptions(scenario=scenario, log=log, bblog=bblog))
        logs.append(log.read_text())
    assert logs[0] == logs[1]
    assert "info SkillerInterface Skiller TRUE 1 " in logs[0]
    assert len(list((tmp_path / "bb").iterdir())) == 4


@contextmanager
def running(folder: Path) -> Iterator[tuple[Started, Path]]:
    """Yield a process with a run in real time and a long skill, and the Skiller's file."""
    scenario = write_scenario(folder / "s", mapping="act: wait{seconds=1000}")
    command = [
        "run",
        str(scenario),
        "--clock",
        "real",
        "--timeout",
        "60",
        "-q",
        "--bblog",
        str(folder / "bb"),
    ]
    with Started(*command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        yield process, wait_for_entries(folder / "bb", 2)


def wait_for_entries(folder: Path, count: int) -> Path:
    """Wait until the Skiller's file has ``count`` entries, and return its path."""
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline:
        for path in folder.glob(f"*-{SKILLER}-*.log"):
            if path.stat().st_size >= 196 + count * (8 + 1216):
                return path
        time.sleep(0.05)
    raise AssertionError("the run has written too few entries")


def test_killed_run_leaves_complete_entries_without_count(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with running(tmp_path) as (process, path):
        process.kill()
        process.wait()
    data = path.read_bytes()
    assert struct.unpack_from("<I", data, 12) == (0,)
    assert (len(data) - 196) % (8 + 1216) == 0
    assert invoke(["trace", "transitions", str(path)]) == 0
    assert 'skill="wait{seconds=1000}" msgid=2 status=S_RUNNING' in capsys.readouterr().out


def test_interrupted_run_writes_count(tmp_path: Path) -> None:
    with running(tmp_path) as (process, path):
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=20) == 130
    check_as_fawkes_does(path)
