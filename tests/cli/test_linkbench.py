"""The figures of the link: their shape, and the relations between them that any machine must show."""

from __future__ import annotations

import json
import math
from dataclasses import fields

import pytest

from curveline.bench import link
from curveline.bench.measurement import Measurement
from curveline.radio.host.actions import Policy
from curveline.radio.mock.air import HOST_US, Weather

from .conftest import Run

NAMES = 2 * 2 * len(link.COUNTS) + 2 * 2 + 2 * 2 * 2 + 2


def test_json_has_every_figure(run: Run) -> None:
    result = run("bench", "--link", "--json")
    assert result.code == 0
    rows = {row["name"]: row for row in json.loads(result.out)["rows"]}
    assert len(rows) == NAMES
    for row in rows.values():
        assert set(row) == {field.name for field in fields(Measurement)}
        assert math.isfinite(row["value"])
        assert row["value"] > 0.0
        assert len(row["name"]) <= 33
    assert rows["nrf24, 8 nodes, no loss"]["value"] == pytest.approx(105, abs=1)
    assert rows["polls a step, 8 nodes, 30 % loss"]["value"] <= 1.15
    assert rows["polls a step, 8 nodes, 50 % loss"]["value"] <= 1.5


def test_a_batch_costs_one_request() -> None:
    """Sixteen nodes in one exchange over serial: the 2 ms of the request are paid once."""
    plan = link._plan(16, 1)
    spent = [link._run(plan, each, Weather(), link.FLAT_OUT) for each in link.BACK_ENDS]
    spi, serial = (each.virtual_us / each.polls for each in spent)
    assert serial == pytest.approx(spi - HOST_US + 50 + 2000 / 16, rel=0.05)


def test_a_step_waits_for_all_and_no_longer() -> None:
    spent = link._run(link._plan(4, 10), link.BACK_ENDS[0], Weather(), Policy())
    assert len(spent.latencies_ms) == 9
    assert all(0 < wait < 50 for wait in spent.latencies_ms)


def test_the_link_has_no_shapes(run: Run) -> None:
    result = run("bench", "--link", "--quick")
    assert result.code == 2
    assert "--link measures no shapes" in result.err
