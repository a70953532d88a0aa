"""Nodes of machines and waiting places in a navigation graph."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from cxbridge.space.navgraph import NavGraph
from cxbridge_rcll.field import Field
from cxbridge_rcll.stations import WAIT_ZONE_COUNT, StationNodes

MACHINES = [
    {"name": "C-BS", "zone": "C-Z65", "rotation": 270},
    {"name": "C-DS", "zone": "M-Z23", "rotation": 0},
    {"name": "M-BS", "zone": "", "rotation": 0},
]


@pytest.fixture
def graph():
    return NavGraph("field")


@pytest.fixture
def stations(graph):
    return StationNodes(Field(lambda: MACHINES), lambda: graph)


def send(stations, kind, **fields):
    stations.handle(SimpleNamespace(type=f"{kind}Message", **fields))


def test_machine_has_nodes_at_its_sides(graph, stations):
    send(stations, "UpdateStationByTag", name="C-BS")
    assert not graph.nodes
    send(stations, "Compute")
    assert {node.name for node in graph.nodes} == {"C-BS-I", "C-BS-O", "WAIT-C-BS-I", "WAIT-C-BS-O", "C-BS"}
    centre = graph.node("C-BS")
    assert (round(centre.x, 2), round(centre.y, 2), centre.unconnected) == (5.5, 4.5, True)
    assert round(graph.node("C-BS-I").distance(graph.node("C-BS-O").x, graph.node("C-BS-O").y), 2) == 1.5


@pytest.mark.parametrize(("name", "kinds"), [("M-BS", ["Compute"]), ("C-BS", ["Clear", "Compute"])])
def test_unknown_or_cleared_machine_has_no_nodes(graph, stations, name, kinds):
    send(stations, "UpdateStationByTag", name=name)
    for kind in kinds:
        send(stations, kind)
    assert not graph.nodes


def test_waiting_zones_are_apart_from_machines(graph, stations):
    for machine in MACHINES:
        send(stations, "UpdateStationByTag", name=machine["name"])
    send(stations, "Compute")
    send(stations, "GenerateWaitZones")
    zones = [node for node in graph.nodes if node.name[1:3] == "-Z"]
    assert sorted(node.name[0] for node in zones) == ["C"] * WAIT_ZONE_COUNT + ["M"] * WAIT_ZONE_COUNT
    for zone in zones:
        assert all(zone.distance(graph.node(name).x, graph.node(name).y) >= 1.5 for name in ("C-BS", "C-DS"))


def test_second_computation_replaces_nodes(graph, stations):
    send(stations, "UpdateStationByTag", name="C-BS")
    send(stations, "Compute")
    before = graph.nodes
    send(stations, "Compute")
    assert graph.nodes == before
