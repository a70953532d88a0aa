"""Trees of PlanSys2 whose nodes share children."""

from __future__ import annotations

import pytest

from cxbridge.errors import CxbridgeError


def test_a_goal_tree_of_plansys2_whose_nodes_share_children_is_refused():
    pytest.importorskip("rosbags", reason="the extra ros2 is not installed")
    from cxbridge_ros2.experts.nodes import NodeCodec, TreeNodeKind

    empty = {"expression_type": 0, "modifier_type": 0, "name": "", "parameters": [], "value": 0.0}
    nodes = [
        {**empty, "node_type": int(TreeNodeKind.AND), "node_id": at, "children": [at + 1, at + 1]}
        for at in range(31)
    ]
    nodes.append(
        {**empty, "node_type": int(TreeNodeKind.PREDICATE), "node_id": 31, "children": [], "name": "a"}
    )
    with pytest.raises(CxbridgeError, match="two parents"):
        NodeCodec("jazzy").decode_tree({"nodes": nodes})
