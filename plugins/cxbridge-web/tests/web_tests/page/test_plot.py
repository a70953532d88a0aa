"""The tab Plot: live and recorded series, and the selected moment."""

from __future__ import annotations

import json
import re
from typing import Any
from urllib.parse import quote

import pytest

from web_tests.page.conftest import wait_for
from web_tests.page.fake import START_US, fact_model, goal_event

POSE = "Position3DInterface::Pose"


def write(at_s: float, x: float, frame: str = "map", uid: str = POSE) -> dict[str, Any]:
    """Return the event of a pose's write."""
    values = {"frame": frame, "translation": [x, -x, 0.0]}
    return {"kind": "interface", "time_us": START_US + round(at_s * 1e6), "uid": uid, "values": values}


def fact(at_s: float, text: str, *, asserted: bool = True) -> dict[str, Any]:
    plain = {"kind": "fact", "env": "executive", "index": 1, "asserted": asserted}
    return plain | {
        "time_us": START_US + round(at_s * 1e6),
        "template": text[1:].split(maxsplit=1)[0],
        "text": text,
    }


def loop(at_s: float, number: int, duration_us: int) -> dict[str, Any]:
    return {
        "kind": "loop",
        "time_us": START_US + round(at_s * 1e6),
        "loop": number,
        "duration_us": duration_us,
    }


def lines(*events: dict[str, Any]) -> bytes:
    """Return a recording as lines of JSON."""
    return "\n".join(map(json.dumps, events)).encode()


def address(*names: str) -> str:
    return "#/plot" + "".join("/" + quote(name, safe="") for name in names)


def values_of(tab: Any) -> dict[str, str]:
    """Return the value of each series at the cursor, by name."""
    rows = tab.locator("#plot-legend tr[data-series]").all()
    return {row.get_attribute("data-series"): row.locator(".value").inner_text() for row in rows}


@pytest.mark.smoke
def test_field_is_plotted_from_blackboard_and_follows_writes(tab, site, daemon):
    info = {"type": "Position3DInterface", "id": "Pose", "hash": "", "writer": "W", "readers": []}
    daemon.answers["blackboard/interfaces"] = [info | {"fields": [], "message_types": []}]
    now = {"kind": "InterfaceData", "timestamp": "", "data": write(0, 1.5)["values"]}
    daemon.answers["blackboard/interfaces/Position3DInterface/Pose/data"] = now
    tab.goto(f"{site.url}#/blackboard/{quote(POSE)}")
    tab.get_by_label("plot translation").click()
    tab.wait_for_selector("#plot-legend tr >> nth=2")
    x = f"{POSE}.translation[0]"
    wait_for(tab, lambda: values_of(tab).get(x) == "1.5000")
    assert list(values_of(tab)) == [f"{POSE}.translation[{at}]" for at in range(3)]
    daemon.send_events(write(61, 2.25))
    wait_for(tab, lambda: values_of(tab)[x] == "2.2500")
    # the series continues while the view Log is open
    tab.goto(f"{site.url}#/log")
    daemon.send_events(write(62, 9.5))
    tab.goto(f"{site.url}#/plot")
    wait_for(tab, lambda: values_of(tab).get(x) == "9.5000")


def test_typed_names_are_completed(tab, site, daemon):
    daemon.answers |= {
        "cxbridge/interfaces": [{"type": "T", "id": "a/b", "data": {"speed": 1, "way": [1, 2]}}],
        "clips/executive/facts": [fact_model(1, "(robot (name r1) (charge 7))")],
    }
    tab.goto(f"{site.url}#/plot")
    tab.wait_for_selector("text=Nothing is plotted yet")
    tab.fill("#plot-name", "a/b")
    wait_for(tab, lambda: tab.locator("#plot-names option").count() == 3)
    completions = [each.get_attribute("value") for each in tab.locator("#plot-names option").all()]
    assert completions == ["T::a/b.speed", "T::a/b.way[0]", "T::a/b.way[1]"]
    tab.fill("#plot-name", "robot{name=r1}.charge")
    tab.keyboard.press("Enter")
    name = "executive:robot{name=r1}.charge"
    wait_for(tab, lambda: values_of(tab) == {name: "7"})
    daemon.send_events(fact(70, "(robot (name r2) (charge 1))"), fact(71, "(robot (name r1) (charge 6))"))
    wait_for(tab, lambda: values_of(tab) == {name: "6"})
    assert quote(name, safe="") in tab.url


def test_plot_shows_texts_and_loop_times_in_milliseconds(tab, site, daemon):
    state = "executive:plan-action{id=2}.state"
    tab.goto(site.url + address(state, "loop"))
    tab.wait_for_selector("#plot-legend tr >> nth=1")
    daemon.send_events(
        loop(60.1, 7, 1500),
        fact(60.2, "(plan-action (id 2) (state FORMULATED))"),
        fact(60.3, "(plan-action (id 2) (state RUNNING))"),
        loop(60.4, 8, 12_250),
    )
    wait_for(tab, lambda: values_of(tab) == {state: "RUNNING", "loop": "12.250"})


def test_plot_of_recording_shares_selected_moment(tab, site, daemon):
    """A click selects the moment of all views, and the moment selects the shown values."""
    goals = [goal_event("G", "FORMULATED"), goal_event("G", "SELECTED", time_us=START_US + 10_000_000)]
    daemon.files["run.json"] = lines(goals[0], *(write(at, at * 10.0) for at in range(1, 10)), goals[1])
    x = f"{POSE}.translation[0]"
    tab.goto(f"{site.url}?run=files/run.json{address(x)}")
    tab.wait_for_selector("#state >> text=RECORDING")
    wait_for(tab, lambda: values_of(tab) == {x: "90"})
    box = tab.locator(".chart canvas").bounding_box()
    tab.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    wait_for(tab, lambda: "time=" in tab.url)
    (moment,) = map(int, re.findall(r"time=(\d+)", tab.url))
    assert START_US + 3e6 < moment < START_US + 7e6
    tab.mouse.move(0, 0)
    tab.evaluate("async (time) => (await import('cx/app.js')).app.select({ time })", START_US + 2_400_000)
    wait_for(tab, lambda: values_of(tab) == {x: "20"})


def test_decimation_of_many_points_keeps_peak(tab, site):
    tab.goto(f"{site.url}#/plot")
    drawn_count, has_peak, is_ordered, maximum = tab.evaluate(
        """async () => {
          const { Series, decimate } = await import("cx/plot/series.js");
          const series = new Series({ name: "s", isStep: false });
          for (let at = 0; at < 100_000; at++) series.push(at, at === 61_234 ? 1e6 : Math.sin(at));
          const points = [];
          decimate(series, 0, series.count, 800, (time) => time / 125, (at) => points.push(at));
          return [points.length, points.includes(61_234),
                  points.every((point, at) => !at || points[at - 1] < point),
                  series.range(0, 100_000)[1]];
        }"""
    )
    assert drawn_count <= 4 * 800
    assert (has_peak, is_ordered, maximum) == (True, True, 1e6)
