"""`cxbridge run --web`, `cxbridge daemon --web` and `cxbridge view`: the page by one command."""

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
def served(*arguments, line="The page is at "):
    """A command that serves a page; yields it and the page's address."""
    with Started(*arguments) as process:
        address = ""
        for said in process.stderr:
            if said.startswith(line):
                address = said.split()[-1]
                break
        assert address, "it has ended before"
        yield process, address


def get(address, path, host=None, method="GET"):
    port = int(address.split(":")[2].partition("/")[0])
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=WAIT_S)
    connection.request(method, path, headers={} if host is None else {"Host": host})
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, body


def test_a_run_with_a_page_stays_open_at_its_end_and_ends_with_its_own_status(tmp_path):
    scenario, port = write_scenario(tmp_path, mapping="act: fail{}"), free_port()
    with served("run", scenario, "--web", port, "--no-browser") as (process, address):
        assert address == f"http://127.0.0.1:{port}"
        status, page = get(address, "/")
        assert status == 200
        assert b"<!doctype html>" in page.lower()
        assert any("unsuccessful, G ended FAILED" in line for line in iter(process.stdout.readline, ""))
        assert "Serving the page until Ctrl-C\n" in iter(process.stderr.readline, "")
        status, answer = get(address, "/api/cxbridge/status")
        found = json.loads(answer)
        assert (status, found["clock"], found["state"]) == (200, "real", "FINISHED")
        assert found["result"] == {"status": 1, "word": "unsuccessful", "reason": "G ended FAILED"}
        assert json.loads(get(address, "/api/cxbridge/status")[1])["now_us"] == found["now_us"], "it is over"
        assert get(address, "/api/clips/executive/facts")[0] == 200, "facts are there after the end"
        why = get(address, "/api/cxbridge/why?goal=G")
        assert why[0] == (200 if find_spec("cxbridge_studio") else 400), why
        if find_spec("cxbridge_studio"):
            told = json.loads(why[1])["data"]["goals"][0]
            assert [cause["text"] for cause in told["cause"]["because"]][-1].startswith("rule "), told
            assert json.loads(get(address, "/api/cxbridge/why")[1])["data"]["unknown"] == []
            facts = json.loads(get(address, "/api/clips/executive/facts?formatted=true")[1])
            index = next(fact["index"] for fact in facts if fact["template_name"] == "begun")
            fact = json.loads(get(address, f"/api/cxbridge/why?fact=f-{index}")[1])["data"]
            assert "fired just before" in fact["headline"]
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 1


def test_the_page_of_a_run_asks_the_same_table_of_rights(tmp_path):
    scenario, port = write_scenario(tmp_path), free_port()
    (tmp_path / "look.yaml").write_text("cxbridge: {remote-control: false}\n")
    command = ("run", scenario, "--config", tmp_path / "look.yaml", "--web", port, "--no-browser")
    with served(*command) as (process, address):
        found = json.loads(get(address, "/api/cxbridge/status")[1])
        assert (found["remote_control"], found["remote_programs"]) == (False, False)
        status, answer = get(address, "/api/cxbridge/pause", method="POST")
        assert (status, b"remote-control" in answer) == (403, True)
        process.send_signal(signal.SIGINT)
        process.wait(WAIT_S)


def test_foxglove_connects_to_a_run_and_stays_connected(tmp_path):
    pytest.importorskip("foxglove", reason="needs foxglove-sdk")
    from web_tests.foxglove.client import connected

    scenario = write_scenario(tmp_path)
    command = ("run", scenario, "--foxglove", "0", "--web", "0", "--no-browser")
    with served(*command) as (process, address):
        said = process.stderr.readline()
        assert said.startswith("Foxglove connects to ws://127.0.0.1:")
        assert "Serving the page and Foxglove until Ctrl-C\n" in iter(process.stderr.readline, "")
        assert get(address, "/api/cxbridge/status")[0] == 200
        with connected(said.split()[-1]) as client:
            client.until(lambda: client.has("/goals"))
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 0


def test_a_daemon_gets_a_page_by_an_option(tmp_path):
    port = free_port()
    endpoint = f"tcp://127.0.0.1:{free_port()}"
    more = ("--endpoint", endpoint, *NO_SERVER, "--no-browser")
    with served("daemon", "--web", port, *more) as (process, address):
        assert address == f"http://127.0.0.1:{port}"
        end_s = time.monotonic() + WAIT_S
        while (status := get(address, "/api/cxbridge/health")[0]) == 503:  # components that still start
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


def test_a_recording_is_opened_by_the_address_that_is_printed(recordings):
    port = free_port()
    with served("view", recordings[0], "--port", port, "--no-browser") as (process, address):
        assert address == f"http://127.0.0.1:{port}/?run=/runs/0/a%2520run.mcap"
        assert get(address, "/runs/0/a%20run.mcap") == (200, recordings[0].read_bytes())
        assert get(address, "/")[0] == 200
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 0


@pytest.mark.parametrize("name", ["snow \N{SNOWMAN}.mcap", "a>b.mcap", "50%.mcap"])
def test_a_recording_of_any_name_is_loaded_with_the_page(recordings, tmp_path, name):
    """The address of the page may have the name quoted once or, as the printed address has it, twice."""
    path = tmp_path / name
    path.write_bytes(recordings[0].read_bytes())
    with served("view", path, "--no-browser") as (_, address):
        origin = address.partition("/?")[0]
        for run in (quote(f"/runs/0/{name}"), quote(quote(f"/runs/0/{name}"))):
            with urlopen(f"{origin}/?run={run}", timeout=WAIT_S) as reply:
                link = reply.headers["Link"]
            assert link.startswith(f"</runs/0/{quote(name)}>; rel=preload"), run
        assert get(address, f"/runs/0/{quote(name)}")[1] == path.read_bytes()


def test_of_several_one_is_chosen_and_no_other_file_is_served(recordings, tmp_path):
    third = tmp_path / "third.mcap"  # two are compared
    third.write_bytes(recordings[0].read_bytes())
    with served("view", *recordings, third, "--no-browser") as (_, address):
        assert address.endswith("/runs/")
        status, chooser = get(address, "/runs/")
        assert status == 200
        assert b'href="/?run=/runs/0/a%2520run.mcap"' in chooser
        status, lines = get(address, "/runs/1/a.log")
        kinds = {json.loads(line)["kind"] for line in lines.splitlines()}
        assert status == 200
        assert kinds == {"log"}, "what the page does not read itself is converted"
        for path in ("/runs/3/x", "/runs/0/../../s/scenario.yaml", "/runs/0/", "/runs", "//etc/passwd"):
            assert get(address, path)[0] == 404, path
        assert get(address, "/api/cxbridge/status")[0] == 404
        assert get(address, "/", host="elsewhere.example")[0] == 421


def test_what_is_no_recording_is_told_at_once(tmp_path, capsys):
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
def test_a_browser_is_opened_for_a_person_who_has_one(no_browser, tty, desktop, opened, monkeypatch, capsys):
    urls: queue.SimpleQueue[str] = queue.SimpleQueue()
    monkeypatch.setattr(webbrowser, "open", urls.put)
    monkeypatch.setattr(web_options, "has_desktop", lambda: desktop)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: tty, raising=False)
    WebOptions(no_browser=no_browser).announce("http://127.0.0.1:1")
    if opened:
        assert urls.get(timeout=WAIT_S) == "http://127.0.0.1:1"
    assert urls.empty()
    assert capsys.readouterr().err == "The page is at http://127.0.0.1:1\n"


def test_a_port_that_is_none_is_told():
    with pytest.raises(CxbridgeError, match="port '70000'"):
        WebOptions(web="70000").check(RunOptions())
    assert WebOptions(web="0").make_server_settings().port == 0
