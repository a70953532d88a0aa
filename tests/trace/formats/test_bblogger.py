"""The files of Fawkes' bblogger, as it wrote them and as its own tool repaired them."""

from __future__ import annotations

import csv
import struct
from pathlib import Path

import pytest

from cxbridge.errors import TraceError
from cxbridge.events import InterfaceWrite, SkillStatus
from cxbridge.interfaces.registry import default_registry
from cxbridge.trace.compare.result import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.bblogger import MAGIC
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.formats.transitions_text import format_transition
from cxbridge.trace.levels import View
from tests.support import needs_shared
from tests.trace.runs import NAMES, RECORDINGS

KIND = "SpeechSynthInterface"


def make(
    order: str, entries: list[tuple[int, int]], *, flag: int = 1, count: int = 0, size: int = 0
) -> bytes:
    """A file whose entries were written at these (seconds after start, seconds of the block)."""
    schema = default_registry().schema(KIND)
    final = schema.field("final")
    assert final is not None
    data = MAGIC + struct.pack(
        f"{order}II32s48s64s16sIqq",
        flag,
        count,
        b"test",
        KIND.encode(),
        b"Flite",
        b"\0" * 16,
        size or schema.datasize,
        1000,
        0,
    )
    for since, stamp in entries:
        block = bytearray(schema.datasize)
        struct.pack_into(f"{order}qq", block, 0, stamp, 0)
        block[final.offset] = 1
        data += struct.pack(f"{order}II", since, 0) + block
    return data


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("flag", [0, 1])
def test_the_byte_order_is_found_whatever_the_flag_says(tmp_path: Path, order: str, flag: int) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(make(order, [(1, 0), (2, 1500)], flag=flag))
    run = open_run(path)
    events = [event for event in run if isinstance(event, InterfaceWrite)]
    assert [event.time_us for event in events] == [1_001_000_000, 1_500_000_000]
    assert events[0].uid == "SpeechSynthInterface::Flite"
    assert events[0].values["final"] is True
    assert not run.notes


def test_cut_off_and_wrong_counts_are_told(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(make("<", [(1, 0), (2, 0)], count=7)[:-1])
    run = open_run(path)
    assert len(list(run)) == 1
    assert run.notes == ["the file ends within an entry", "the header counts 7 entries, the file has 1"]


def test_a_block_of_another_size_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(make("<", [], size=12))
    with pytest.raises(TraceError, match="have not the 1056 bytes that our definition has"):
        list(open_run(path))


def test_a_folder_is_merged_by_time(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_bytes(make("<", [(1, 10), (2, 30)]))
    (tmp_path / "b.log").write_bytes(make("<", [(1, 20), (2, 40)], count=9))
    run = open_run(tmp_path)
    assert [event.time_us // 10**6 for event in run] == [10, 20, 30, 40]
    assert run.notes == ["b.log: the header counts 9 entries, the file has 2"]


@needs_shared
@pytest.mark.parametrize("folder", ["bblogger", "bblogger-repaired"])
@pytest.mark.parametrize("name", NAMES)
def test_the_skiller_says_what_the_log_says(name: str, folder: str) -> None:
    events = [event for event in open_run(RECORDINGS / name / folder) if isinstance(event, SkillStatus)]
    lines = (RECORDINGS / name / "trace.txt").read_text().splitlines()
    assert [format_transition(event) for event in events] == [
        line for line in lines if line.startswith("SkillerInterface")
    ]


@needs_shared
@pytest.mark.parametrize("kind", ["SkillerInterface", "SpeechSynthInterface"])
def test_values_are_those_of_fawkes_own_conversion(kind: str) -> None:
    (path,) = (RECORDINGS / "skiller-1" / "bblogger-repaired").glob(f"*-{kind}-*.csv")
    rows = list(csv.reader(path.read_text().splitlines()[1:], delimiter=";", quoting=csv.QUOTE_NONE))
    writes = [event for event in open_run(path.with_suffix(".log")) if isinstance(event, InterfaceWrite)]
    assert [[_text(value) for value in event.values.values()] for event in writes] == [
        [_text(value) for value in row[1:]] for row in rows
    ]
    assert rows


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    try:
        return f"{float(str(value)):.4f}"
    except ValueError:
        return str(value)


@needs_shared
@pytest.mark.parametrize("order", Order)
def test_both_runs_of_the_skiller_wrote_the_same(order: Order) -> None:
    """As told by the blocks' own times: the times of the entries are out of order between files."""
    one, other = (open_run(RECORDINGS / name / "bblogger") for name in NAMES[:2])
    comparison = compare_runs(one, [other], View.BLACKBOARD, order)
    assert comparison.same
    assert comparison.count_a == 28
