"""Whether the nodes can carry out a plan, asked before they are taken over: what is refused disturbs nobody."""

from __future__ import annotations

from collections.abc import Sequence

from curveline.errors import LinkError
from curveline.plan_file import Plan
from curveline.radio.host.node_status import NodeStatus
from curveline.radio.host.preflight import check_place


def check_movable(nodes: Sequence[NodeStatus]) -> None:
    """LinkError if a node says that it cannot move."""
    for node in nodes:
        if node.obstacle:
            raise LinkError(node.obstacle, node.advice, node.node)


def check_ready(plan: Plan, nodes: Sequence[NodeStatus]) -> None:
    """LinkError if a node says that it cannot move, or rests elsewhere than where the plan starts."""
    check_movable(nodes)
    for node in nodes:
        if node.counts is not None and node.state != "moving":
            halt = check_place(plan, node.node, node.counts)
            if halt is not None:
                raise LinkError(halt.message, halt.hint, node.node)
