"""``run --bblog``: its files against those of the real Fawkes; the run does not see the recorder."""

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
    """Check a file as Fawkes' reader does before it reads, in its order; return count and size of the blocks.

    The flag for the byte order must be that of a little endian host, as Fawkes' builds that wrote it right.
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
    """The blocks of the entries of a file."""
    count, size = check_as_fawkes_does(path)
    data = path.read_bytes()[196:]
    return [data[at + 8 : at + 8 + size] for at in range(0, count * (8 + size), 8 + size)]


def without(kind: str, block: bytes, *fields: str) -> bytes:
    """A block with its time stamp and these fields set to zeros."""
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
def ours(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("bblog"))


def recorded(name: str, interface: str) -> Path:
    (path,) = (RECORDINGS / name / "bblogger-repaired").glob(f"*-{interface}-*.log")
    return path


def test_every_interface_that_is_written_has_a_file_that_fawkes_reader_accepts(ours: Path) -> None:
    counts = {path.name: check_as_fawkes_does(path)[0] for path in ours.iterdir()}
    assert counts == {
        f"test-{SKILLER}-{STAMP}.log": 9,
        f"test-{SPEECH}-{STAMP}.log": 8,
        f"test-{DEBUG}-{STAMP}.log": 9,
        f"test-{DEBUG}Layouted-{STAMP}.log": 9,
    }


@needs_shared
@pytest.mark.parametrize("interface", [SKILLER, SPEECH, DEBUG])
def test_headers_equal_the_recorded_ones_but_for_names_counts_and_times(ours: Path, interface: str) -> None:
    mine, other = (
        path.read_bytes()[:196]
        for path in (ours / f"test-{interface}-{STAMP}.log", recorded("skiller-1", interface))
    )
    assert mine[:12] == other[:12]
    assert mine[48:180] == other[48:180]  # type, id, hash, size


@needs_shared
@pytest.mark.parametrize(
    ("skiller", "name"), [("lua", "skiller-1"), ("lua", "skiller-2"), ("simulator", "simulator-1")]
)
def test_the_skiller_writes_the_recorded_blocks_but_for_times_and_serials(
    tmp_path: Path, skiller: str, name: str
) -> None:
    folder = record(tmp_path, skiller)
    mine, other = (
        [without("SkillerInterface", block, "exclusive_controller") for block in blocks(path)]
        for path in (folder / f"test-{SKILLER}-{STAMP}.log", recorded(name, SKILLER))
    )
    assert len(other) == 9
    assert mine == other


@needs_shared
@pytest.mark.parametrize(
    ("interface", "field", "greetings"),
    [(SPEECH, "duration", 2), (DEBUG, "graph", 0)],
    ids=["speech", "debug"],
)
@pytest.mark.parametrize("name", ["skiller-1", "skiller-2"])
def test_speech_and_graphs_are_written_as_recorded(
    ours: Path, name: str, interface: str, field: str, greetings: int
) -> None:
    """But for a field: how long the speech takes, and the text of the graph, which is of another skill.

    The recorded speech synthesis wrote a greeting first.
    """
    mine, other = (
        [without(interface.partition("-")[0], block, field) for block in blocks(path)]
        for path in (ours / f"test-{interface}-{STAMP}.log", recorded(name, interface))
    )
    assert all(block[16:].startswith(b"Speech synth loaded") for block in other[:greetings])
    assert mine == other[greetings:]


@pytest.mark.parametrize("clock", ["virtual", "scaled:20"])
def test_times_count_from_the_start_by_the_runs_clock(tmp_path: Path, clock: str) -> None:
    (path,) = record(tmp_path, clock=clock).glob(f"*-{SKILLER}-*.log")
    data = path.read_bytes()
    start, start_us = struct.unpack_from("<qq", data, 180)
    zone = time.gmtime if clock == "virtual" else time.localtime
    assert path.name == f"test-{SKILLER}-{time.strftime('%Y-%m-%d-%H-%M-%S', zone(start))}.log"
    entries = [struct.unpack_from("<IIqq", data, at) for at in range(196, len(data), 8 + 1216)]
    assert len(entries) == 9
    since = [seconds * 10**6 + us for seconds, us, _, _ in entries]
    stamps = [seconds * 10**6 + us - start * 10**6 - start_us for _, _, seconds, us in entries]
    assert all(one <= other for one, other in itertools.pairwise(since))
    assert since[-1] > 4_000_000
    # the block is stamped a moment before it is recorded, no time at all on the virtual clock
    latest = 0 if clock == "virtual" else 2_000_000
    assert all(0 <= told - stamp <= latest for told, stamp in zip(since, stamps, strict=True))


def test_two_runs_write_the_same_bytes(tmp_path: Path) -> None:
    one, other = (
        {path.name: path.read_bytes() for path in record(tmp_path / folder).iterdir()} for folder in "ab"
    )
    assert one == other


# --- the run is the same as without the recorder ------------------------------------------------------------

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


def test_the_run_is_the_same_to_the_byte_and_the_agent_sees_no_reader(tmp_path: Path) -> None:
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
    """A run in real time in a separate process whose skill takes long, and the skiller's file."""
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
    """Wait until the skiller's file has ``count`` entries, and return it."""
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline:
        for path in folder.glob(f"*-{SKILLER}-*.log"):
            if path.stat().st_size >= 196 + count * (8 + 1216):
                return path
        time.sleep(0.05)
    raise AssertionError("the run wrote too little")


def test_a_killed_run_leaves_whole_entries_and_no_count(
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


def test_an_interrupted_run_is_counted(tmp_path: Path) -> None:
    with running(tmp_path) as (process, path):
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=20) == 130
    check_as_fawkes_does(path)
