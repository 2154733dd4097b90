"""Where on a step the states of a rod are weighed: not less often than in equal parts, in rows at shared lengths."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import pytest

from curveline.planning.layout import Box
from curveline.planning.tours import make_plan
from curveline.planning.verification import LOOKS, Passed, Verifier, looks_at
from curveline.rod.branches.tracking import TrackedState
from curveline.rod.problem import Pose
from rows import row

LEVEL = Pose(0.5, 0.0, 0.0, 0.0, 0.5)


@pytest.mark.parametrize(("begin", "end"), [(0.5, 0.5158), (0.5071, 0.5913), (0.58, 0.501), (0.53, 0.5300001)])
@pytest.mark.parametrize("is_row", [False, True])
def test_no_two_looks_are_farther_apart_than_an_eighth(begin: float, end: float, is_row: bool) -> None:
    looks = looks_at(LEVEL._replace(length=begin), LEVEL._replace(length=end), is_row=is_row)
    assert {looks[0].length, looks[-1].length} == {begin, end}
    lengths = sorted(pose.length for pose in looks)
    assert len(lengths) == len(set(lengths)) <= 2 * LOOKS + 2
    assert max(high - low for low, high in pairwise(lengths)) <= abs(end - begin) / LOOKS * (1.0 + 1e-6)


def test_steps_of_a_row_share_looks_and_those_that_turn_nodes_do_not() -> None:
    one = looks_at(LEVEL, LEVEL._replace(length=0.53), is_row=True)
    other = looks_at(LEVEL._replace(length=0.507), LEVEL._replace(length=0.541), is_row=True)
    assert len(set(one) & set(other)) >= 4
    turned = LEVEL._replace(length=0.53, start=0.1)
    assert looks_at(LEVEL, turned, is_row=True) == looks_at(LEVEL, turned, is_row=False)
    assert looks_at(turned, turned, is_row=True) == [turned]


def test_a_long_row_searches_few_poses_for_each_of_its_segments(monkeypatch: pytest.MonkeyPatch) -> None:
    verifiers = []
    begin = Verifier.__init__
    monkeypatch.setattr(Verifier, "__init__", lambda self, *given: (verifiers.append(self), begin(self, *given))[1])
    make_plan(row(16))
    searched = sum(bool(shown.planar) for shown in verifiers[0]._showable.values())
    assert searched < 16 * 20


def test_what_was_proven_once_is_not_proven_again(monkeypatch: pytest.MonkeyPatch) -> None:
    proven: Counter[tuple[object, ...]] = Counter()
    keep, funnel = Verifier._keep, Verifier._funnel

    def kept(self: Verifier, before: Pose, after: Pose, box: Box, hold: TrackedState) -> Passed:
        proven[before, after, box, hold.key] += 1
        return keep(self, before, after, box, hold)

    def funnelled(self: Verifier, before: Pose, after: Pose, box: Box, wanted: str) -> Passed:
        proven[before, after, box, wanted] += 1
        return funnel(self, before, after, box, wanted)

    monkeypatch.setattr(Verifier, "_keep", kept)
    monkeypatch.setattr(Verifier, "_funnel", funnelled)
    assert len(make_plan(row(7)).steps) > 10
    assert set(proven.values()) == {1}
