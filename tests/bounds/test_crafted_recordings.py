"""Recordings with values of unexpected types and sizes end in no traceback.

Each reading command gets a recording for each odd value. The recording has every message of a valid
recording, and per kind of message and field a copy with the odd value, unless refused by the reader.
Further recordings have the value in an attached JSON file, or in the metadata. Readers of the formats get
copies with one odd value each.
"""

from __future__ import annotations

import json
import random
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import islice
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from cxbridge.cli.main import invoke
from cxbridge.errors import CxbridgeError
from cxbridge.event_kinds import EVENT_TYPES
from cxbridge.run.options import RunOptions
from cxbridge.run.run import run_scenario
from cxbridge.trace.codec import EventFormatError, make_decoder
from cxbridge.trace.formats.registry import copy_formats, open_run
from tests.run.mini import write_scenario
from tests.support import many, share

DEEP = 30_000
MOST_COPIES = many(40, 11)
ODD = {
    "a number of 5,000 digits": "9" * 5000,
    "a negative number of 5,000 digits": "-" + "9" * 5000,
    "a number beyond 64 bits": str(2**70),
    "a number beyond a double": "1e999",
    "not a number": "NaN",
    "infinity": "-Infinity",
    "a fraction": "0.5",
    "null": "null",
    "a truth value": "true",
    "a text": '"x"',
    "an empty text": '""',
    "half a character": '"\\ud800"',
    "a zero byte": '"\\u0000"',
    "a long text": json.dumps("(" * 70_000),
    "a text of digits": json.dumps("9" * 5000),
    "a list": "[1, [2], {}]",
    "an object": '{"a": {"b": []}}',
    "deep lists": "[" * DEEP + "]" * DEEP,
    "deep objects": '{"a":' * DEEP + "1" + "}" * DEEP,
}
GONE = "no value"
PLACES = ("messages", "attachments", "metadata")
CASES = share([(name, where) for name in (*ODD, GONE) for where in PLACES], 10, row=lambda case: case[1])
"""Some of the values, in each of the places."""


class Scene:
    """A scenario, a run of it, and the copies of the run in all formats."""

    def __init__(self, folder: Path) -> None:
        self.scenario = write_scenario(folder / "mini")
        self.run = folder / "run.mcap"
        run_scenario(RunOptions(scenario=self.scenario, trace=self.run, trace_level="facts"))
        self.copies: dict[str, Path] = {}
        for form in copy_formats():
            copy = folder / f"copy-{form}"
            if invoke(["trace", "convert", str(self.run), str(copy), "--to", form]) == 0:
                self.copies[form] = copy


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return Scene(tmp_path_factory.mktemp("scene"))


def text_of(fields: Mapping[str, str]) -> str:
    return "{" + ",".join(f"{json.dumps(key)}:{field_text}" for key, field_text in fields.items()) + "}"


def with_value(text: str, value: str | None) -> Iterator[str]:
    """Yield a JSON object once for each field, with a value in its place; None: without it."""
    whole = json.loads(text)
    plain = {key: json.dumps(field_value) for key, field_value in whole.items()}
    for name, field_value in whole.items():
        rest = {key: part for key, part in plain.items() if key != name}
        yield text_of(rest if value is None else {**plain, name: value})
        if isinstance(field_value, dict) and field_value:
            yield from (text_of({**plain, name: inner}) for inner in with_value(plain[name], value))
        if isinstance(field_value, list) and value is not None:
            yield text_of({**plain, name: f"[{value},{plain[name][1:]}" if field_value else f"[{value}]"})
        if isinstance(field_value, str) and re.search(r"\d", field_value):
            yield text_of({**plain, name: json.dumps(re.sub(r"\d+", "9" * 5000, field_value))})


DECODERS = {f"cxbridge.{kind.__name__}": make_decoder(kind) for kind in EVENT_TYPES.values()}


def is_event(schema: str, data: bytes) -> bool:
    """Whether the reader of mcap files accepts a message; a refusal has to be the reader's error."""
    try:
        DECODERS[schema](data)
    except EventFormatError:
        return False
    return True


def craft(source: Path, target: Path, where: str, value: str | None) -> Path:
    """Write a recording with an odd value in its messages, its attachments or its metadata."""
    with source.open("rb") as file, target.open("wb") as out:
        reader, writer = make_reader(file), Writer(out, compression=CompressionType.NONE)
        summary = reader.get_summary()
        assert summary is not None
        writer.start(profile=reader.get_header().profile)
        schemas = {
            number: writer.register_schema(schema.name, schema.encoding, schema.data)
            for number, schema in summary.schemas.items()
        }
        channels = {
            number: writer.register_channel(
                channel.topic, channel.message_encoding, schemas.get(channel.schema_id, 0), channel.metadata
            )
            for number, channel in summary.channels.items()
        }
        for attachment in reader.iter_attachments():
            odd = where == "attachments" and attachment.name.endswith(".json")
            data = (value or "").encode("utf-8", "surrogatepass") if odd else attachment.data
            writer.add_attachment(
                attachment.create_time, attachment.log_time, attachment.name, attachment.media_type, data
            )
        for record in reader.iter_metadata():
            odd = where == "metadata"
            fields = dict.fromkeys(record.metadata, (value or "")[:6000]) if odd else dict(record.metadata)
            writer.add_metadata(record.name, fields)
        seen: set[int] = set()
        for schema, channel, message in reader.iter_messages():
            texts = [message.data]
            if where == "messages" and channel.id not in seen:
                seen.add(channel.id)
                odd_ones = with_value(message.data.decode(), value)
                texts += [text.encode("utf-8", "surrogatepass") for text in odd_ones]
            for text in texts:
                if text is message.data or is_event(schema.name if schema else "", text):
                    writer.add_message(channels[channel.id], message.log_time, text, message.publish_time)
        writer.finish()
    return target


def reading_commands(run: Path, scene: Scene, folder: Path) -> Iterator[list[str]]:
    """Yield the command lines that look at a recording."""
    file = str(run)
    yield from (["trace", command, file] for command in ("info", "cat", "transitions", "rules", "exchange"))
    yield from (["trace", command, file, "--json"] for command in ("info", "cat", "exchange"))
    yield ["trace", "diff", file, str(scene.run)]
    yield ["trace", "diff", str(scene.run), file, "--order", "partial", "--level", "facts"]
    yield ["trace", "extract", file, "-o", str(folder / "files")]
    yield ["trace", "report", file, "-o", str(folder / "report.html")]
    yield ["trace", "repair", file, "-o", str(folder / "repaired.mcap")]
    for form in copy_formats():
        yield ["trace", "convert", file, str(folder / f"copy-{form}"), "--to", form]
    yield ["coverage", file]
    yield ["coverage", file, "--scenario", str(scene.scenario)]
    yield ["why", "goal", "G", "--run", file]
    yield ["why", "rule", "mini-evaluate", "--run", file]
    yield ["run", str(scene.scenario), "--replay", file, "--timeout", "20"]


@pytest.mark.parametrize(("name", "where"), CASES)
def test_commands_on_crafted_recording_print_error(
    scene: Scene, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, where: str
):
    run = craft(scene.run, tmp_path / "crafted.mcap", where, ODD.get(name))
    wrong: dict[str, str] = {}
    for arguments in share(reading_commands(run, scene, tmp_path), 8):
        words = " ".join(arguments).replace(str(tmp_path), "")
        try:
            invoke(arguments)
        except Exception as error:  # noqa: BLE001 - the list of them is the result
            wrong[words] = f"{type(error).__name__}: {str(error)[:200]}"
        output = capsys.readouterr()
        if "Traceback" in output.err:
            wrong[words] = output.err[-1000:]
    assert wrong == {}


@pytest.mark.parametrize("damaged", [False, True], ids=["whole", "cut"])
def test_repair_reports_damage_that_cat_refuses(
    scene: Scene,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    damaged: bool,
):
    run = tmp_path / "refused.mcap"
    with monkeypatch.context() as patch:
        patch.setitem(globals(), "is_event", lambda _schema, _data: True)
        craft(scene.run, run, "messages", ODD["an object"])
    if damaged:
        run.write_bytes(run.read_bytes()[:-20])
    assert invoke(["trace", "cat", str(run)]) == 2
    assert invoke(["trace", "repair", str(run)]) == 2
    assert "fine" not in capsys.readouterr().out


def test_all_writable_formats_are_crafted(scene: Scene):
    assert set(scene.copies) == set(copy_formats())


def odd_texts(text: str) -> Iterator[str]:
    """Yield a text with odd values in the place of one number, for each kind of number."""
    seen = set()
    for found in re.finditer(r"-?\d+(?:\.\d+)?", text):
        line = text[text.rfind("\n", 0, found.start()) + 1 : found.start()]
        shape = re.sub(r"\d+", "9", line)[-30:]
        if shape in seen:
            continue
        seen.add(shape)
        for value in ("9" * 5000, "-" + "9" * 5000, "1e999", "nan", "", "\u0663", "x"):
            yield text[: found.start()] + value + text[found.end() :]


@pytest.mark.parametrize("form", copy_formats())
def test_reader_of_crafted_copy_raises_trace_errors_only(scene: Scene, tmp_path: Path, form: str):
    source = scene.copies[form]
    files = sorted(source.iterdir()) if source.is_dir() else [source]
    tried = 0
    for file in files:
        data = file.read_bytes()
        is_text = b"\0" not in data[:4096]
        odd = map(str.encode, odd_texts(data.decode("utf-8", "replace"))) if is_text else odd_bytes(data)
        for number, made in enumerate(islice(odd, MOST_COPIES)):
            target = tmp_path / f"{file.name}-{number}"
            if source.is_dir():
                shutil.copytree(source, target)
                crafted_file = target / file.name
            else:
                crafted_file = target
            crafted_file.write_bytes(made)
            with suppress(CxbridgeError):
                run = open_run(target)
                list(run)
                dict(run.metadata())
                list(run.source_records())
            shutil.rmtree(target) if target.is_dir() else target.unlink()
            tried += 1
    assert tried > 10


def odd_bytes(data: bytes) -> Iterator[bytes]:
    """Yield data with some changed bytes, from the beginning on."""
    chance = random.Random(0)
    for _ in range(MOST_COPIES):
        made = bytearray(data)
        for _ in range(chance.choice((1, 4, 40))):
            made[chance.randrange(min(len(made), 1 << chance.randrange(4, 20)))] = chance.choice(
                (0, 1, 127, 255)
            )
        yield bytes(made)
