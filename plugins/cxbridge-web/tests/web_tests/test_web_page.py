"""The commands `cxbridge run --web`, `cxbridge daemon --web` and `cxbridge view`."""

from __future__ import annotations

import http.client
import json
import queue
import signal
import sys
import time
import webbrowser
from contextlib import contextmanager
from importlib.util import find_spec
from urllib.parse import quote
from urllib.request import urlopen

import pytest

from cxbridge.cli.main import invoke
from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions
from cxbridge_web import options as web_options
from cxbridge_web.options import WebOptions
from tests.fawkes import NO_SERVER
from tests.programs import Started
from tests.run.mini import write_scenario
from tests.support import free_port

WAIT_S = 60


@contextmanager
def serve(*arguments, line="The page is at "):
    """Start a command that serves a page; yield the process and the address of the page."""
    with Started(*arguments) as process:
        address = ""
        for output in process.stderr:
            if output.startswith(line):
                address = output.split()[-1]
                break
        assert address, "the process has ended without an address"
        yield process, address


def get(address, path, host=None, method="GET"):
    port = int(address.split(":")[2].partition("/")[0])
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=WAIT_S)
    connection.request(method, path, headers={} if host is None else {"Host": host})
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, body


def test_run_serves_page_after_end_and_keeps_status(tmp_path):
    scenario, port = write_scenario(tmp_path, mapping="act: fail{}"), free_port()
    with serve("run", scenario, "--web", port, "--no-browser") as (process, address):
        assert address == f"http://127.0.0.1:{port}"
        status, page = get(address, "/")
        assert status == 200
        assert b"<!doctype html>" in page.lower()
        assert any("unsuccessful, G ended FAILED" in line for line in iter(process.stdout.readline, ""))
        assert "Serving the page until Ctrl-C\n" in iter(process.stderr.readline, "")
        status, answer = get(address, "/api/cxbridge/status")
        status_document = json.loads(answer)
        assert (status, status_document["clock"], status_document["state"]) == (200, "real", "FINISHED")
        assert status_document["result"] == {"status": 1, "word": "unsuccessful", "reason": "G ended FAILED"}
        assert json.loads(get(address, "/api/cxbridge/status")[1])["now_us"] == status_document["now_us"], (
            "the clock of the finished run stands"
        )
        assert get(address, "/api/clips/executive/facts")[0] == 200, "the finished run still has facts"
        why = get(address, "/api/cxbridge/why?goal=G")
        assert why[0] == (200 if find_spec("cxbridge_studio") else 400), why
        if find_spec("cxbridge_studio"):
            goal = json.loads(why[1])["data"]["goals"][0]
            assert [cause["text"] for cause in goal["cause"]["because"]][-1].startswith("rule "), goal
            assert json.loads(get(address, "/api/cxbridge/why")[1])["data"]["unknown"] == []
            facts = json.loads(get(address, "/api/clips/executive/facts?formatted=true")[1])
            index = next(fact["index"] for fact in facts if fact["template_name"] == "begun")
            fact = json.loads(get(address, f"/api/cxbridge/why?fact=f-{index}")[1])["data"]
            assert "fired just before" in fact["headline"]
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 1


def test_page_of_run_has_rights_of_configuration(tmp_path):
    scenario, port = write_scenario(tmp_path), free_port()
    (tmp_path / "rights.yaml").write_text("cxbridge: {remote-control: false}\n")
    command = ("run", scenario, "--config", tmp_path / "rights.yaml", "--web", port, "--no-browser")
    with serve(*command) as (process, address):
        status_document = json.loads(get(address, "/api/cxbridge/status")[1])
        assert (status_document["remote_control"], status_document["remote_programs"]) == (False, False)
        status, answer = get(address, "/api/cxbridge/pause", method="POST")
        assert (status, b"remote-control" in answer) == (403, True)
        process.send_signal(signal.SIGINT)
        process.wait(WAIT_S)


def test_run_serves_foxglove_until_interrupt(tmp_path):
    pytest.importorskip("foxglove", reason="needs foxglove-sdk")
    from web_tests.foxglove.client import connected

    scenario = write_scenario(tmp_path)
    command = ("run", scenario, "--foxglove", "0", "--web", "0", "--no-browser")
    with serve(*command) as (process, address):
        line = process.stderr.readline()
        assert line.startswith("Foxglove connects to ws://127.0.0.1:")
        assert "Serving the page and Foxglove until Ctrl-C\n" in iter(process.stderr.readline, "")
        assert get(address, "/api/cxbridge/status")[0] == 200
        with connected(line.split()[-1]) as client:
            client.until(lambda: client.has("/goals"))
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 0


def test_daemon_serves_page_with_option(tmp_path):
    port = free_port()
    endpoint = f"tcp://127.0.0.1:{free_port()}"
    more = ("--endpoint", endpoint, *NO_SERVER, "--no-browser")
    with serve("daemon", "--web", port, *more) as (process, address):
        assert address == f"http://127.0.0.1:{port}"
        end_s = time.monotonic() + WAIT_S
        while (
            status := get(address, "/api/cxbridge/health")[0]
        ) == 503:  # some components are still starting
            assert time.monotonic() < end_s
            time.sleep(0.05)
        assert status == 200
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 0


@pytest.fixture
def recordings(tmp_path):
    scenario = write_scenario(tmp_path / "s")
    mcap, log = tmp_path / "a run.mcap", tmp_path / "a.log"
    assert invoke(["run", str(scenario), "-q", "--trace", str(mcap), "--log", str(log)]) == 0
    return mcap, log


def test_printed_address_opens_recording(recordings):
    port = free_port()
    with serve("view", recordings[0], "--port", port, "--no-browser") as (process, address):
        assert address == f"http://127.0.0.1:{port}/?run=/runs/0/a%2520run.mcap"
        assert get(address, "/runs/0/a%20run.mcap") == (200, recordings[0].read_bytes())
        assert get(address, "/")[0] == 200
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 0


@pytest.mark.parametrize("name", ["snow \N{SNOWMAN}.mcap", "a>b.mcap", "50%.mcap"])
def test_recording_with_unusual_name_is_preloaded(recordings, tmp_path, name):
    """The address of the page may quote the name once, or twice as the printed address does."""
    path = tmp_path / name
    path.write_bytes(recordings[0].read_bytes())
    with serve("view", path, "--no-browser") as (_, address):
        origin = address.partition("/?")[0]
        for run in (quote(f"/runs/0/{name}"), quote(quote(f"/runs/0/{name}"))):
            with urlopen(f"{origin}/?run={run}", timeout=WAIT_S) as reply:
                link = reply.headers["Link"]
            assert link.startswith(f"</runs/0/{quote(name)}>; rel=preload"), run
        assert get(address, f"/runs/0/{quote(name)}")[1] == path.read_bytes()


def test_chooser_serves_only_given_recordings(recordings, tmp_path):
    third = tmp_path / "third.mcap"  # two recordings would be compared
    third.write_bytes(recordings[0].read_bytes())
    with serve("view", *recordings, third, "--no-browser") as (_, address):
        assert address.endswith("/runs/")
        status, chooser = get(address, "/runs/")
        assert status == 200
        assert b'href="/?run=/runs/0/a%2520run.mcap"' in chooser
        status, lines = get(address, "/runs/1/a.log")
        kinds = {json.loads(line)["kind"] for line in lines.splitlines()}
        assert status == 200
        assert kinds == {"log"}, "formats that the page cannot read are converted"
        for path in ("/runs/3/x", "/runs/0/../../s/scenario.yaml", "/runs/0/", "/runs", "//etc/passwd"):
            assert get(address, path)[0] == 404, path
        assert get(address, "/api/cxbridge/status")[0] == 404
        assert get(address, "/", host="elsewhere.example")[0] == 421


def test_invalid_or_missing_recording_has_status_2(tmp_path, capsys):
    (tmp_path / "none.mcap").write_text("no")
    assert invoke(["view", str(tmp_path / "none.mcap")]) == 2
    assert "none.mcap" in capsys.readouterr().err
    assert invoke(["view", str(tmp_path / "missing.mcap")]) == 2


@pytest.mark.parametrize(
    ("no_browser", "tty", "desktop", "opened"),
    [
        (False, True, True, True),
        (True, True, True, False),
        (False, False, True, False),
        (False, True, False, False),
    ],
)
def test_browser_opens_only_on_desktop_with_terminal(no_browser, tty, desktop, opened, monkeypatch, capsys):
    urls: queue.SimpleQueue[str] = queue.SimpleQueue()
    monkeypatch.setattr(webbrowser, "open", urls.put)
    monkeypatch.setattr(web_options, "has_desktop", lambda: desktop)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: tty, raising=False)
    WebOptions(no_browser=no_browser).announce("http://127.0.0.1:1")
    if opened:
        assert urls.get(timeout=WAIT_S) == "http://127.0.0.1:1"
    assert urls.empty()
    assert capsys.readouterr().err == "The page is at http://127.0.0.1:1\n"


def test_invalid_port_is_error():
    with pytest.raises(CxbridgeError, match="port '70000'"):
        WebOptions(web="70000").check(RunOptions())
    assert WebOptions(web="0").make_server_settings().port == 0
