"""The map of the tab World: navigation graph, frames and robots with trails, live and recorded."""

from __future__ import annotations

import math
from typing import Any

import pytest

from web_tests.page.conftest import wait_for
from web_tests.page.fake import START_US, goal_event
from web_tests.page.test_plot import lines

NODES = {
    "hall": {"x": 0.0, "y": 0.0, "unconnected": False, "properties": {}},
    "kitchen": {"x": 4.0, "y": 2.0, "unconnected": False, "properties": {"room": "true"}},
}
EDGES = {"hall--kitchen": {"from": "hall", "to": "kitchen", "directed": False}}
GRAPH = {"graph": "House", "nodes": NODES, "edges": EDGES}


def quarter_turns(count: float) -> list[float]:
    return [0.0, 0.0, math.sin(count * math.pi / 4), math.cos(count * math.pi / 4)]


def pose(at_s: float, x: float, y: float, frame: str = "map", turns: float = 0, uid: str = "r1") -> Any:
    values = {
        "frame": frame,
        "translation": [x, y, 0.0],
        "rotation": quarter_turns(turns),
        "visibility_history": 3,
    }
    return {
        "kind": "interface",
        "time_us": START_US + round(at_s * 1e6),
        "uid": f"Position3DInterface::{uid}",
        "values": values,
    }


def transform(parent: str, child: str, x: float, y: float, turns: float = 0, at_s: float = 0) -> Any:
    values = {
        "frame": parent,
        "child_frame": child,
        "static_transform": False,
        "translation": [x, y, 0.0],
        "rotation": quarter_turns(turns),
    }
    uid = f"TransformInterface::/tf/{child}"
    return {"kind": "interface", "time_us": START_US + round(at_s * 1e6), "uid": uid, "values": values}


def navgraph(at_s: float = 0) -> Any:
    return {"kind": "navgraph", "time_us": START_US + round(at_s * 1e6), **GRAPH}


def map_rows(tab: Any) -> dict[str, list[str]]:
    """Return the rows of the map's table by name."""
    elements = tab.locator("#map-items tr[data-item]").all()
    return {row.get_attribute("data-item"): row.locator("td").all_inner_texts() for row in elements}


def count_pixels(tab: Any, colour: str) -> int:
    """Return the number of the map's pixels with the colour of a series."""
    count: int = tab.evaluate(
        """(name) => {
          const canvas = document.querySelector(".map-box canvas"), probe = document.createElement("i");
          probe.style.color = "var(" + name + ")";
          document.body.append(probe);
          const wanted = getComputedStyle(probe).color.match(/\\d+/g).map(Number);
          probe.remove();
          const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
          let count = 0;
          for (let at = 0; at < data.length; at += 4)
            if (wanted.every((part, which) => data[at + which] === part)) count += 1;
          return count;
        }""",
        colour,
    )
    return count


@pytest.mark.smoke
def test_map_shows_poses_and_trails_of_robots(tab, site, daemon):
    daemon.answers |= {"cxbridge/navgraphs": [GRAPH], "cxbridge/interfaces": []}
    tab.goto(f"{site.url}#/map")
    tab.wait_for_selector(".map-box canvas")
    daemon.send_events(pose(61, 1.0, 0.5))
    wait_for(tab, lambda: map_rows(tab) == {"r1": ["1.00", "0.50", "0°"]})
    daemon.send_events(pose(62, 3.0, 1.5, turns=1))
    wait_for(tab, lambda: map_rows(tab) == {"r1": ["3.00", "1.50", "90°"]})
    tab.wait_for_timeout(100)
    assert count_pixels(tab, "--series-1") > 40


def test_node_under_pointer_shows_name_place_and_properties(tab, site, daemon):
    daemon.answers |= {"cxbridge/navgraphs": [GRAPH], "cxbridge/interfaces": []}
    tab.goto(f"{site.url}#/map")
    tab.wait_for_selector(".map-box canvas")
    tab.wait_for_timeout(100)
    box = tab.locator(".map-box canvas").bounding_box()
    scale = min(box["width"] / 5, box["height"] / 2.5)
    tab.mouse.move(
        box["x"] + box["width"] / 2 + 2 * scale, box["y"] + box["height"] / 2 - scale
    )  # the graph is in the middle of the canvas
    tab.wait_for_selector("#map-told:text-is('kitchen: 4.00, 2.00 m; room true')")


def test_map_transforms_poses_to_selected_frame(tab, site, daemon):
    daemon.answers |= {"cxbridge/navgraphs": [], "cxbridge/interfaces": []}
    tab.goto(f"{site.url}#/map")
    tab.wait_for_selector("text=No robot has done anything yet")
    daemon.send_events(
        transform("map", "odom", 10, 0, turns=1),
        transform("odom", "base_link", 2, 0),
        pose(1, 1.0, 0.0, frame="/base_link", uid="cup"),
        pose(1, 5.0, 5.0, frame="elsewhere", uid="lost"),
    )
    wait_for(tab, lambda: len(map_rows(tab)) == 4)
    assert map_rows(tab) == {
        "cup": ["10.00", "3.00", "90°"],
        "lost": ["in elsewhere, not connected to map"],
        "odom": ["10.00", "0.00", "90°"],
        "base_link": ["10.00", "2.00", "90°"],
    }
    tab.select_option("#map-frame", "odom")
    wait_for(tab, lambda: map_rows(tab)["cup"] == ["3.00", "0.00", "0°"])
    tab.uncheck("text=frames")
    wait_for(tab, lambda: list(map_rows(tab)) == ["cup", "lost"])


def test_recording_shows_selected_moment_and_recorded_graph(tab, site, daemon):
    run = [navgraph(), *(pose(at, float(at), 0.0) for at in range(1, 6)), goal_event("G", "FORMULATED")]
    run[-1]["time_us"] = START_US + 9_000_000
    daemon.files["run.json"] = lines(*run)
    tab.goto(f"{site.url}?run=files/run.json#/map")
    tab.wait_for_selector("#state >> text=RECORDING")
    wait_for(tab, lambda: map_rows(tab) == {"r1": ["5.00", "0.00", "0°"]})
    tab.evaluate("async (time) => (await import('cx/app.js')).app.select({ time })", START_US + 2_500_000)
    wait_for(tab, lambda: map_rows(tab) == {"r1": ["2.00", "0.00", "0°"]})
    trail = tab.evaluate(
        """async () => {
          const { app } = await import("cx/app.js"), { tracksOf } = await import("cx/map/store.js");
          const { tracks } = tracksOf(app), [track] = tracks.poses.values();
          return [tracks.trail(track, "map", app.recording.time), [...tracks.graphs.keys()]];
        }"""
    )
    assert trail == [[[1, 0], [2, 0]], ["House"]]
