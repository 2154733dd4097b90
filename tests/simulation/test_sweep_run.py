"""Points of a sweep computed many at a time come to the very bytes that they come to one by one, on any route."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import chain, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from curveline.errors import CurvelineError, InvalidInput
from curveline.kernels import readiness
from curveline.simulation import batch, sweep_run
from curveline.simulation.batch import Order, Simulated, Task, line_of
from curveline.simulation.results import Settings
from curveline.simulation.sweep import Sweep, SweepTally, digests
from curveline.simulation.sweep_files import NpzFile, rows_and_curves_of, rows_of
from curveline.simulation.sweep_run import Stretch, SweepRun
from curveline.simulation.sweep_view import gathering, view_of

ROW = """name = "row"
display = "quad"
nodes = [
  { height_mm = 0.0, angle_deg = 30.0 },
  { height_mm = 40.0, angle_deg = -10.0 },
  { height_mm = 0.0, angle_deg = 20.0 },
  { height_mm = -30.0, angle_deg = 0.0 },
  { height_mm = 10.0, angle_deg = 5.0 },
]
segments = [
  { length_mm = 640.0, state = "peak" },
  { length_mm = 650.0, state = "valley" },
  { length_mm = 630.0, state = "peak" },
  { length_mm = 610.0, state = "peak" },
]
"""
LOADED = """name = "loaded"
display = "DISPLAY"
nodes = [ { height_mm = 0.0, angle_deg = 30.0 }, { height_mm = 20.0, angle_deg = -30.0 } ]
segments = [ { length_mm = 660.0, state = "valley" } ]
loads = [ { segment = 1, at = 0.4, force_N = [0.02, -0.05] } ]
"""
FLAT = """name = "flat"
display = "single"
nodes = [ { height_mm = 0.0, angle_deg = 0.0 }, { height_mm = 0.0, angle_deg = 0.0 } ]
segments = [ { length_mm = 500.0, state = "straight" } ]
"""
MAKERS = (digests, line_of, rows_of, rows_and_curves_of)
PLAIN = ("level-up-peak", ["nodes.1.angle_deg=-30:30:7", "nodes.2.angle_deg=-30:30:5"])
MIXED = ("level-up-peak", ["nodes.1.angle_deg=-60:60:9", "segments.1.length_mm=540:900:7"])


@pytest.fixture
def row(tmp_path: Path) -> str:
    path = tmp_path / "row.toml"
    path.write_text(ROW)
    return str(path)


@pytest.fixture
def flat(tmp_path: Path) -> str:
    path = tmp_path / "flat.toml"
    path.write_text(FLAT)
    return str(path)


@pytest.fixture
def weightless(tmp_path: Path) -> str:
    from curveline.shapes.files import builtin_text

    display, shape = tmp_path / "table.toml", tmp_path / "loaded.toml"
    display.write_text(builtin_text("single").replace("gravity = true", "gravity = false"))
    shape.write_text(LOADED.replace("DISPLAY", "table.toml"))
    return str(shape)


class Stored:
    """What a sweep's file is written to."""

    def __init__(self) -> None:
        self.content = io.BytesIO()

    @contextmanager
    def stream(self) -> Iterator[io.BytesIO]:
        yield self.content


def products(stretches: Iterable[Stretch], maker: int) -> list[Any]:
    return [each for stretch in stretches if stretch.error is None for each in stretch.products[maker]]


def without_time(text: str) -> list[str]:
    """Documents but for the time that they took."""
    found = []
    for line in text.split("\n"):
        before, _, rest = line.partition('"seconds": ')
        found.append(before + rest.partition(",")[2])
    return found


def known(sweep: Sweep, settings: Settings, stretches: list[Stretch]) -> tuple[Any, ...]:
    """All that comes of a sweep, to be compared to the bit: tally, documents, rows, file of arrays, failures."""
    tally = SweepTally.of(len(sweep.file.scene.segments))
    for each in products(stretches, 0):
        tally.add(each)
    file = Stored()
    arrays = NpzFile(file, sweep, settings)  # type: ignore[arg-type]
    for each in products(stretches, 3):
        arrays.take(each)
    arrays.finish()
    failures = [(each.first, each.swept, str(each.error)) for each in stretches if each.error]
    rows = [*chain(*products(stretches, 2))]
    order = [list(groups) for groups in tally.groups]
    return tally, order, without_time("\n".join(products(stretches, 1))), repr(rows), file.content.getvalue(), failures


def one_by_one(sweep: Sweep, order: Order) -> list[Stretch]:
    return [sweep_run._stretch_of(task, answer) for task, answer in batch.run(sweep.tasks(), order, 1, len(sweep))]


def many(stretches: list[Stretch]) -> int:
    """Points that were looked at together with their neighbours."""
    return sum(each.last - each.first + 1 for each in stretches if each.last > each.first)


@pytest.mark.parametrize(
    "case",
    [
        (*PLAIN, Settings(points=9), 35),
        (*MIXED, Settings(points=9), 20),
        (*MIXED, Settings(points=9, model="planar"), 20),
        ("row", ["nodes.1.angle_deg=-20:20:3", "nodes.3.angle_deg=-60:60:7"], Settings(points=4), 12),
        ("weightless", ["nodes.2.height_mm=-40:40:5", "nodes.1.angle_deg=-40:40:5"], Settings(points=5), 5),
        # At so rough a tolerance a rod that is nearly straight would pass for a planar one.
        ("flat", ["segments.1.length_mm=500:500.6:7", "nodes.2.angle_deg=-1:1:3"], Settings(0.05, 5), 6),
        ("staggered-up-peak", ["nodes.1.height_mm=-60:60:4", "nodes.2.angle_deg=-30:30:3"], Settings(1e-6, 5), 0),
    ],
)
def test_points_together_are_points_one_by_one(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, case: tuple[str, list[str], Settings, int]
) -> None:
    which, axes, settings, together = case
    shape = request.getfixturevalue(which) if which in ("row", "weightless", "flat") else which
    monkeypatch.setattr(sweep_run, "MOSTLY", 0.0)
    sweep, order = Sweep(shape, axes), Order(settings, MAKERS)
    found = list(SweepRun(sweep, order, 1).stretches())
    assert [number for each in found for number in range(each.first, each.last + 1)] == list(range(1, len(sweep) + 1))
    assert together <= many(found) <= len(sweep) - (axes is MIXED[1])
    assert known(sweep, settings, found) == known(sweep, settings, one_by_one(sweep, order))


@pytest.mark.parametrize("axes", [MIXED[1], PLAIN[1][:1], [*PLAIN[1], "segments.1.length_mm=660:660:1"]])
def test_figures_show_the_same_of_points_together(monkeypatch: pytest.MonkeyPatch, axes: list[str]) -> None:
    monkeypatch.setattr(sweep_run, "MOSTLY", 0.0)
    sweep = Sweep("level-up-peak", axes)
    order = Order(Settings(), (digests, gathering(view_of(sweep)).make))
    found = list(SweepRun(sweep, order, 1).stretches())
    assert many(found) > 5
    assert repr(products(found, 1)) == repr(products(one_by_one(sweep, order), 1))


@pytest.mark.parametrize("makers", [MAKERS, (digests, rows_of, rows_and_curves_of)])
def test_threads_come_to_the_same(monkeypatch: pytest.MonkeyPatch, makers: tuple[Any, ...]) -> None:
    monkeypatch.setattr(sweep_run, "MOSTLY", 0.0)
    monkeypatch.setattr("curveline.simulation.plain_points.MOST_AT_ONCE", 5)
    sweep, order = Sweep(*MIXED), Order(Settings(points=3), makers)
    run = SweepRun(sweep, order, 3)
    assert run.is_on_threads
    found, expected = list(run.stretches()), list(SweepRun(sweep, order, 1).stretches())
    for place, make in enumerate(makers):
        one, other = (products(each, place) for each in (found, expected))
        if make is rows_of:
            assert repr([*chain(*one)]) == repr([*chain(*other)])
        if make is line_of:
            assert without_time("\n".join(one)) == without_time("\n".join(other))


@pytest.mark.parametrize("jobs", [1, 3])
def test_a_point_that_fails_is_told_in_its_place(monkeypatch: pytest.MonkeyPatch, jobs: int) -> None:
    monkeypatch.setattr(sweep_run, "MOSTLY", 0.0)
    perform = batch.perform

    def failing(order: Order, task: Task) -> Simulated | CurvelineError:
        return CurvelineError(f"no {task.number}") if task.number % 2 else perform(order, task)

    monkeypatch.setattr(batch, "perform", failing)
    found = list(SweepRun(Sweep(*MIXED), Order(Settings(), (digests,)), jobs).stretches())
    failed = [each for each in found if each.error is not None]
    assert len(failed) > 3
    assert [str(each.error) for each in failed] == [f"no {each.first}" for each in failed]
    assert failed[0].swept == Sweep(*MIXED).task(failed[0].first).swept
    assert [each.first for each in found] == sorted(each.first for each in found)


def test_words_are_as_long_as_the_longest_that_is_there() -> None:
    sweep, settings = Sweep(*PLAIN), Settings(points=3)
    (found,) = SweepRun(sweep, Order(settings, (rows_and_curves_of,)), 1).stretches()
    (arrays,) = found.products[0]
    padded = arrays._replace(columns=tuple(x.astype("<U20") if x.dtype.kind == "U" else x for x in arrays.columns))
    contents = []
    for each in (arrays, padded):
        file = Stored()
        whole = NpzFile(file, sweep, settings)  # type: ignore[arg-type]
        whole.take(each)
        whole.finish()
        contents.append(file.content.getvalue())
    assert contents[0] == contents[1]


def test_most_points_decide_and_so_does_what_is_asked_for() -> None:
    order = Order(Settings(), (digests,))
    assert SweepRun(Sweep(*PLAIN), order, 2).is_on_threads
    scenes = [
        (Sweep("level-up-peak", ["segments.1.length_mm=800:900:20"]), order),
        (Sweep("level-up-peak", ["nodes.1.roll_deg=0:10:2"]), order),
        (Sweep(*PLAIN), Order(Settings(windings=(0, 1)), (digests,))),
        (Sweep(*PLAIN), Order(Settings(model="spatial"), (digests,))),
        (Sweep(*PLAIN), Order(Settings(explained=True), (digests, line_of))),
        (Sweep(*PLAIN), Order(Settings(), (digests, lambda task, report: None))),
    ]
    for sweep, other in scenes:
        assert SweepRun(sweep, other, 1)._plain is None


def test_kernels_are_compiled_before_threads_share_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    looked_at: list[int] = []
    perform = batch.perform
    monkeypatch.setattr(readiness, "is_first_run", lambda: True)
    monkeypatch.setattr(batch, "perform", lambda order, task: looked_at.append(task.number) or perform(order, task))
    SweepRun(Sweep(*PLAIN), Order(Settings(), (digests,)), 2)
    assert looked_at == [1]


def test_who_stops_drawing_ends_the_threads() -> None:
    import threading

    before = threading.active_count()
    stretches = SweepRun(Sweep(*PLAIN), Order(Settings(), (digests,)), 3).stretches()
    next(stretches)
    stretches.close()
    assert threading.active_count() == before


def test_points_that_break_no_rule_need_not_be_looked_at(row: str, weightless: str) -> None:
    rng = np.random.default_rng(14)
    keys = {
        row: [("nodes.2.height_mm", -260.0, 260.0), ("nodes.2.angle_deg", -80.0, 80.0)]
        + [(f"segments.{number}.length_mm", 480.0, 920.0) for number in (1, 2, 3)],
        weightless: [("nodes.1.height_mm", -260.0, 260.0), ("segments.1.length_mm", 480.0, 560.0)],
        "level-up-peak": [("nodes.1.angle_deg", -80.0, 80.0), ("nodes.2.yaw_deg", -20.0, 20.0)],
    }
    spared = refused = 0
    for _ in range(60):
        shape = str(rng.choice(list(keys)))
        chosen = rng.permutation(len(keys[shape]))[:2]
        axes = []
        for key, least, most in (keys[shape][index] for index in chosen):
            low, high = sorted(rng.uniform(least, most, 2))
            axes.append(f"{key}={low}:{high}:5")
        sweep = Sweep(shape, axes)
        bad = set()
        for number, values in sweep._points():
            try:
                sweep._scene(values)
            except InvalidInput:
                bad.add(number)
        doubtful = {number for number, _ in sweep._doubtful()}
        assert bad <= doubtful
        spared += len(sweep) - len(doubtful)
        refused += len(bad)
        if bad:
            with pytest.raises(InvalidInput, match=f"{len(bad)} of {len(sweep)} points cannot be used"):
                sweep.check(lambda number: None)
        else:
            sweep.check(lambda number: None)
    assert spared > 300
    assert refused > 100


def test_a_point_is_found_by_its_number() -> None:
    sweep = Sweep(
        "level-up-peak", ["nodes.1.angle_deg=-3:3:3", "nodes.2.angle_deg=-2:2:2", "segments.1.length_mm=600:700:4"]
    )
    assert [sweep.task(number) for number in range(1, 25)] == list(sweep.tasks())
    assert sweep.poses is not None
    swept = [[value for _, value in task.swept] for task in sweep.tasks()]
    assert sweep.poses.values(np.arange(24)).tolist() == swept
    assert swept == list(map(list, product(*(axis.values() for axis in sweep.axes))))
