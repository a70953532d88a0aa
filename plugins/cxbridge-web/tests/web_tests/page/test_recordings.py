"""Opening of recordings in the page: dropped, chosen, linked, packed, damaged and invalid files."""

from __future__ import annotations

import base64
import io
import json
import random
from typing import Any

import pytest

from cxbridge.cli.main import invoke
from web_tests.page.conftest import wait_for
from web_tests.page.fake import START_US, goal_event

LINES = 2000


def events() -> list[dict[str, Any]]:
    """Return a run with goals, and with a log that is long enough for compression."""
    rng = random.Random(7)
    line = {"kind": "log", "level": "I", "component": "Test"}
    events_without_time = [goal_event("G", mode) for mode in ("FORMULATED", "SELECTED", "EXPANDED")]
    events_without_time += [line | {"text": f"line {number} of {rng.random()}"} for number in range(LINES)]
    return [each | {"time_us": START_US + at} for at, each in enumerate(events_without_time)]


def mcap(packed: str = "NONE") -> bytes:
    """Return the run as an mcap file, whose chunks are packed by `ZSTD`, by `LZ4` or not."""
    writer = pytest.importorskip("mcap.writer", reason="needs mcap")
    out = io.BytesIO()
    file = writer.Writer(out, chunk_size=40_000, compression=writer.CompressionType[packed])
    file.start("cxbridge", "test")
    channels = {}
    for kind, schema in (("goal", "cxbridge.GoalTransition"), ("log", "cxbridge.LogLine")):
        number = file.register_schema(schema, "jsonschema", b"{}")
        channels[kind] = file.register_channel(f"/{kind}", "json", number)
    for event in events():
        data = json.dumps({name: value for name, value in event.items() if name != "kind"}).encode()
        time_ns = event["time_us"] * 1000
        file.add_message(channels[event["kind"]], log_time=time_ns, publish_time=time_ns, data=data)
    file.finish()
    return out.getvalue()


def drop(tab: Any, name: str, content: bytes) -> None:
    """Drop a file onto the page."""
    transfer = tab.evaluate_handle(
        """([name, text]) => {
          const bytes = Uint8Array.from(atob(text), (each) => each.charCodeAt(0));
          const transfer = new DataTransfer();
          transfer.items.add(new File([bytes], name));
          return transfer;
        }""",
        [name, base64.b64encode(content).decode()],
    )
    for event_type in ("dragenter", "dragover", "drop"):
        tab.dispatch_event("body", event_type, {"dataTransfer": transfer})


def choose(tab: Any, path: Any) -> None:
    with tab.expect_file_chooser() as chooser:
        tab.click("#open-recording")
    chooser.value.set_files(path)


@pytest.mark.smoke
def test_dropped_mcap_is_shown(tab, site):
    tab.goto(f"{site.url}#/log")
    tab.wait_for_selector("#state >> text=RUNNING")
    drop(tab, "run.mcap", mcap())
    tab.wait_for_selector("#state >> text=RECORDING")
    tab.wait_for_selector(f".count:text-is('{LINES}')")
    last = events()[-1]["text"]
    tab.wait_for_selector(f"[role=option] >> text={last}")
    assert tab.locator("#drop").is_hidden()
    assert tab.locator(".toast.bad").count() == 0


def test_packed_mcap_is_error_with_command_to_unpack(tab, site, tmp_path):
    path, unpacked = tmp_path / "run.mcap", tmp_path / "unpacked.mcap"
    path.write_bytes(mcap("ZSTD"))
    tab.goto(f"{site.url}#/log")
    choose(tab, path)
    tab.wait_for_selector(".toast.bad >> text=unpack it with 'cxbridge trace convert FILE OUT --to mcap'")
    assert invoke(["trace", "convert", str(path), str(unpacked), "--to", "mcap"]) == 0
    choose(tab, unpacked)
    tab.wait_for_selector(f".count:text-is('{LINES}')")


def cut_off(content: bytes) -> bytes:
    return content[: len(content) * 2 // 3]


def damaged(content: bytes) -> bytes:
    begin = content.index(b"line 20 ")
    return content[:begin] + bytes(400) + content[begin + 400 :]


@pytest.mark.parametrize(
    ("damage", "note"), [(cut_off, "The file was cut off"), (damaged, "Some events could not be read")]
)
def test_readable_part_of_damaged_file_is_shown_with_note(tab, site, tmp_path, damage, note):
    path = tmp_path / "run.mcap"
    path.write_bytes(damage(mcap()))
    tab.goto(f"{site.url}#/log")
    choose(tab, path)
    tab.wait_for_selector(f".toast.bad >> text={note}")
    assert 0 < int(tab.locator(".count").inner_text()) < LINES


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x89PNG\r\n\x1a\n\0\0\0\0",
        b"just\nsome text\n",
        b"I 23:59:59.500000 CLIPS: a log\n",
        b'{"a": 1}\n',
    ],
)
def test_invalid_file_is_refused_with_error(tab, site, content):
    tab.goto(f"{site.url}#/goals")
    tab.wait_for_selector("#state >> text=RUNNING")
    drop(tab, "invalid", content)
    tab.wait_for_selector(".toast.bad >> text=invalid is not a recording")
    assert tab.locator("#state").inner_text().endswith("RUNNING")


@pytest.mark.parametrize(
    ("path", "reason"),
    [("files/none.mcap", "this server has no"), ("http://example.org/run.mcap", "it is on another server")],
)
def test_broken_link_is_error_with_reason(tab, site, path, reason):
    tab.goto(f"{site.url}?run={path}")
    tab.wait_for_selector(f".toast.bad >> text={reason}")
    tab.wait_for_selector("#state >> text=RUNNING")


def test_recording_of_several_agents_is_filtered_by_agent(tab, site, daemon):
    fact = {"kind": "fact", "time_us": START_US, "asserted": True, "index": 1, "template": "domain-fact"}
    run = [goal_event("HOUSE", "SELECTED", env=env) for env in ("robot1", "robot2")]
    run += [
        fact | {"env": env, "text": f"(domain-fact (name at) (param-values {env} hall))"}
        for env in ("robot1", "robot2")
    ]
    daemon.files["run.jsonl"] = "\n".join(map(json.dumps, run)).encode()
    tab.goto(f"{site.url}?run=files/run.jsonl#/goals")
    tab.wait_for_selector("[role=treeitem] >> text=in robot1")
    assert tab.get_by_role("treeitem").count() == 2
    tab.select_option("select.env", "robot2")
    wait_for(tab, lambda: tab.get_by_role("treeitem").count() == 1)
    tab.keyboard.press("7")
    tab.wait_for_selector("#main .row >> text=robot2 hall")
    assert tab.locator("#main .row").count() == 1
