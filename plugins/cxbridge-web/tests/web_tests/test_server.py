"""The web server of a daemon: status, events, access and settings."""

from __future__ import annotations

import base64
import threading

import pytest

from cxbridge.daemon.options import DaemonOptions
from cxbridge.errors import ConfigError
from cxbridge.events import LogLine
from cxbridge_web.endpoint import ApiError, Endpoint, EndpointTable
from cxbridge_web.pages import Page
from tests.daemon.test_daemon import QUIET, running, settings
from tests.run.mini import write_scenario
from web_tests.support import read_events, serving

TOKEN = "correct horse battery"


@pytest.fixture(name="scenario", scope="module")
def _scenario(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("web") / "mini")


def test_daemon_can_pause_resume_and_reset(scenario):
    with serving(config=scenario) as (daemon, client, _):
        status = client.get("/api/cxbridge/status").json
        assert (status["kind"], status["state"], status["endpoints"]) == (
            "Status",
            "RUNNING",
            daemon.endpoints,
        )
        assert [part["name"] for part in status["components"]][:2] == ["blackboard", "web"]
        assert status["environments"][0]["name"] == "executive"
        assert status["environments"][0]["rules"] > 100
        assert client.ask("POST", "/api/cxbridge/pause").json["state"] == "PAUSED"
        assert client.get("/api/cxbridge/status").json["state"] == "PAUSED"
        assert client.get("/api/clips-executive/goals").status == 200
        assert client.ask("POST", "/api/cxbridge/resume").json["state"] == "RUNNING"
        assert client.ask("POST", "/api/cxbridge/reset").json["state"] == "RUNNING"


def test_stream_sends_transitions_and_resumes_at_last_id(scenario):
    with serving(config=scenario) as (_, client, _lines):
        modes = {}
        with client.open("GET", "/api/cxbridge/events?kinds=goal&since=0") as stream:
            assert stream.headers["content-type"] == "text/event-stream"
            for event_id, event, data in read_events(stream):
                if event == "hello":
                    continue
                assert (data["kind"], data["goal"], data["env"]) == ("goal", "G", "executive")
                modes[event_id] = data["mode"]
                if data["mode"] == "RETRACTED":
                    break
        assert list(modes.values())[:3] == ["FORMULATED", "SELECTED", "EXPANDED"]
        ids = list(modes)
        for headers, query in (({"Last_Event_ID": ids[-2]}, ""), ({}, f"&since={ids[-2]}")):
            with client.open("GET", f"/api/cxbridge/events?kinds=goal{query}", **headers) as stream:
                resumed = (event_id for event_id, event, _ in read_events(stream) if event != "hello")
                assert next(resumed) == ids[-1]
        with client.open("GET", "/api/cxbridge/events?kinds=goal&since=former-9.9.9.9") as stream:
            buffered = (event_id for event_id, event, _ in read_events(stream) if event != "hello")
            assert next(buffered) == ids[0], "after a restart of the server, a client gets all kept events"


def test_facts_and_rules_are_watched_only_during_stream(scenario):
    with serving(config=scenario) as (daemon, client, _):
        client.until("/api/cxbridge/status", lambda status: status["web"]["clients"] == 0)
        with client.open("GET", "/api/cxbridge/events?kinds=fact,rule,interface") as stream:
            kinds = set()
            for _, _, data in read_events(stream):
                kinds.add(data["kind"])
                if {"fact", "rule", "interface"} <= kinds:
                    break
        client.until("/api/cxbridge/status", lambda status: status["web"]["clients"] == 0)
        loops, pause = daemon.loop.cycle_count, threading.Event()
        while daemon.loop.cycle_count < loops + 2:
            pause.wait(0.01)
        env = daemon.node.env
        assert not env.watcher.rules
        assert not env.watcher.facts


@pytest.mark.parametrize("query", ["kinds=goal,nonsense", "since=nonsense", "since=1-²"])
def test_stream_with_invalid_query_is_refused(scenario, query):
    with serving((("executive", False),)) as (_, client, _lines):
        assert client.get(f"/api/cxbridge/events?{query.replace('²', '%C2%B2')}").status == 400


def test_unknown_path_has_error_of_fawkes():
    with serving((("executive", False),)) as (_, client, _lines):
        for path, text in (
            ("/api/", "REST API overview not yet implemented\n"),
            ("/api/nope/x", "REST API 'nope' unknown\n"),
            ("/api/clips-executive/x", "REST API 'clips-executive' has no endpoint '/x'\n"),
            ("/api/clips-executive", "REST API 'clips-executive' has no endpoint ''\n"),
        ):
            answer = client.get(path)
            assert (answer.status, answer.text) == (404, text)


def test_path_of_missing_plugin_names_package():
    with pytest.raises(ApiError, match=r"has no endpoint '/facts/1': .* the plug-in cxbridge-studio: "):
        EndpointTable([Endpoint(method="GET", path="/cxbridge/status", handler=print, summary="")]).find(
            "DELETE", "/cxbridge/facts/1"
        )


# -- access


def test_foreign_host_name_is_refused():
    with serving((("executive", False),)) as (_, client, _lines):
        assert client.get("/api/cxbridge/status", Host="evil.example:80").status == 421
        assert client.get("/api/cxbridge/status", Host="localhost:1").status == 200
        assert client.get("/api/cxbridge/status", Host="[::1]").status == 200


def test_foreign_origin_needs_permission():
    lab = "http://lab:8080"
    with serving((("executive", False), ("web/allow-origins", [lab]))) as (_, client, _lines):
        assert client.get("/api/cxbridge/status", Origin="http://evil.example").status == 403
        assert client.get("/api/cxbridge/status", Origin=client.url).status == 200
        answer = client.get("/api/cxbridge/status", Origin=lab)
        assert (answer.status, answer.headers["Access-Control-Allow-Origin"]) == (200, lab)
        preflight = client.ask("OPTIONS", "/api/x", Origin=lab, Access_Control_Request_Method="PUT")
        assert preflight.status == 204
        assert "PUT" in preflight.headers["Access-Control-Allow-Methods"]


def test_token_grants_access():
    with serving((("executive", False), ("web/token", TOKEN))) as (_, client, _lines):
        basic = base64.b64encode(f"me:{TOKEN}".encode()).decode()
        refused = client.get("/api/cxbridge/status")
        assert (refused.status, refused.headers["WWW-Authenticate"]) == (401, 'Basic realm="cxbridge"')
        for invalid in ("Bearer x", "Basic x", f"Digest {TOKEN}", "Basic /w=="):
            assert client.get("/api/cxbridge/status", Authorization=invalid).status == 401
        for valid in (f"Bearer {TOKEN}", f"Basic {basic}"):
            assert client.get("/api/cxbridge/status", Authorization=valid).status == 200


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("host: 0.0.0.0", "could be reached from beyond this machine"),
        ("{host: 192.0.2.1, token: 0123456789abcdef}", "could be reached from beyond this machine"),
        ("{token: short}", "too short"),
        ("{tls-cert: a.pem}", "TLS needs both"),
        ("{tls-cert: a.pem, tls-key: b.pem}", "the file does not exist"),
        ("{port: 70000}", "must not be 70000"),
        ("{prot: 1}", "/cxbridge/web/prot is not a setting of a daemon"),
    ],
)
def test_unsafe_or_invalid_settings_are_refused(text, message):
    text = text if text.startswith("{") else f"{{{text}}}"
    with pytest.raises(ConfigError, match=message):
        settings(f"cxbridge:\n  web: {text}\n")


def test_used_port_is_error():
    with serving((("executive", False),)) as (daemon, _, _lines):
        port = int(daemon.endpoints[-1].rpartition(":")[2])
        options = DaemonOptions(settings=(*QUIET, ("executive", False), ("web/port", port)))
        with running(options) as (_d, _l, outcome):
            pass
        assert f"the web server cannot listen on 127.0.0.1:{port}" in str(outcome[0])


def test_daemon_stops_during_stream():
    with serving((("executive", False),)) as (daemon, client, _lines):
        stream = client.open("GET", "/api/cxbridge/events")
        events = read_events(stream)
        next(events)
        daemon.stop()
        assert [data["kind"] for _, _, data in events].count("log") >= 0
        stream.close()


def test_internal_error_is_logged_with_reason(monkeypatch):
    """The log must have more than 'Exception in ASGI application'."""

    async def fault(*_arguments):
        raise RuntimeError("the disk is on fire")

    monkeypatch.setattr(Page, "__call__", fault)
    with serving() as (daemon, client, _):
        texts: list[str] = []
        daemon.bus.subscribe(lambda line: texts.append(line.text), LogLine)
        assert client.get("/").status == 500
        assert any("RuntimeError: the disk is on fire" in text for text in texts)
