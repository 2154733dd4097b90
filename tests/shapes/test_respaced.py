"""A display with other rails: its file is the one that it was, but for what must change."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from curveline.errors import InvalidInput
from curveline.shapes.files import builtin_text, read_display
from curveline.shapes.respaced import respaced


@pytest.mark.parametrize("nodes", [2, 3, 5, 12])
def test_only_what_must_changes(nodes: int) -> None:
    before, after = tomllib.loads(builtin_text("quad")), tomllib.loads(respaced(read_display("quad"), nodes).text)
    assert after.pop("nodes") == nodes
    assert after.pop("span_mm") == pytest.approx(2000.0 / (nodes - 1))
    assert after.pop("name") == f"quad-{nodes}"
    addresses = after["radio"].pop("addresses")
    assert len(set(addresses)) == nodes
    assert addresses[:5] == before["radio"].pop("addresses")[:nodes]
    low, high = after["limits"].pop("length_mm")
    assert low == pytest.approx(after_span(nodes))
    assert high == pytest.approx(1.8 * after_span(nodes))
    before["limits"].pop("length_mm")
    for key in ("nodes", "span_mm", "name"):
        before.pop(key)
    assert after == before


def after_span(nodes: int) -> float:
    return 2000.0 / (nodes - 1)


def test_comments_stay_and_the_width_does() -> None:
    found = respaced(read_display("quad"), 3)
    comments = [line.partition("#")[2] for line in builtin_text("quad").splitlines() if "#" in line]
    assert all(comment in found.text for comment in comments)
    assert found.display.span * 2 == pytest.approx(2.0)
    assert found.display.node_count == 3


def test_odd_files_are_changed_or_refused(tmp_path: Path) -> None:
    text = builtin_text("quad").replace('name = "quad"', "name = 'q # ]' # mine")
    path = tmp_path / "odd.toml"
    path.write_text(text)
    found = respaced(read_display(path), 4)
    assert found.display.name == "q # ]-4"
    assert "# mine" in found.text


@pytest.mark.parametrize("nodes", [0, 1, 129])
def test_numbers_of_nodes_that_no_display_has_are_refused(nodes: int) -> None:
    with pytest.raises(InvalidInput, match="2 to 128"):
        respaced(read_display("quad"), nodes)
