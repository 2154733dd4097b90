"""What results show of themselves in a notebook: whole HTML and SVG, and nothing of a user's that acts as such."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import api_reference
import pytest

import curveline
from curveline.bench.comparison import compare_bench
from curveline.bench.measurement import Measurement
from curveline.bench.report import BenchReport
from curveline.bench.trade import TradePoint
from curveline.notebook import html_of
from curveline.shapes.files import builtin_text

HOSTILE = '<b onclick="x()">&amp; $x_{1}$ \\alpha</b>'
"""A name that is legal, and would be markup, an entity and a formula if anything took it for that."""
SVG = "{http://www.w3.org/2000/svg}"
DRAWN = {
    "Atlas",
    "BenchReport",
    "Comparison",
    "LoadMap",
    "Loading",
    "Plan",
    "RodCalibration",
    "ShapeReport",
    "SnapFall",
    "SweepReport",
}
TABLES = {
    "Adoption",
    "ChannelScan",
    "BenchComparison",
    "DisplayCheck",
    "DisplayStatus",
    "DryRun",
    "Fit",
    "FittedSurface",
    "Halting",
    "LinesDryRun",
    "LinesResult",
    "PoseStates",
    "RangeTest",
    "RodNow",
    "Run",
    "RunLog",
    "RunResult",
    "ScanResult",
    "SegmentStates",
    "SettingsChange",
    "ShapeBatch",
    "SiteFile",
    "StableCurves",
    "Trials",
}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Any]]:
    """One result of every kind, by the name of its class, all of a shape and a display of a hostile name."""
    folder = tmp_path_factory.mktemp("hostile")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("CURVELINE_KEYS", str(folder / "<i>keys.json"))
        named = f"name = '{HOSTILE}'"
        (folder / "mine.toml").write_text(builtin_text("single").replace('name = "single"', named))
        shape = curveline.builtin_shapes()["level-up-peak"].read_text()
        shape = shape.replace('name = "level-up-peak"', named).replace('"single"', '"mine.toml"')
        (folder / "shape.toml").write_text(shape)
        yield {type(each).__name__: each for each in made(folder / "runs")}


def made(runs: Path) -> Iterator[Any]:
    shape = "shape.toml"
    yield (report := curveline.simulate(shape))
    yield report[0]
    yield curveline.simulate_many([shape, "<i>nowhere.toml"])
    yield curveline.simulate_poses(shape, [(0.5, 0.0, 0.5, -0.5, 0.66)])
    yield curveline.sweep(shape, {"nodes.1.angle_deg": (0.0, 30.0, 2)})
    yield (plan := curveline.plan(shape))
    yield curveline.monte_carlo(plan, curveline.TrialsRequest(runs=5, errors=curveline.Errors(feed=0.1)))
    yield (loading := curveline.load(shape, curveline.Push(at=0.4, step=4.0)))
    yield curveline.fall(loading)
    yield curveline.load_map(shape, points=3)
    yield curveline.fit([(0.0, 0.0), (0.25, 0.1), (0.5, 0.0)], "mine.toml", curveline.FitRequest(name=HOSTILE))
    yield curveline.atlas("mine.toml", curveline.AtlasRequest({"angle_deg": (0, 40, 3), "length_mm": (520, 600, 3)}))
    yield curveline.stable_curves("mine.toml")
    yield curveline.surface(
        curveline.surface_of_formula("40*sin(pi*x/500)"),
        "mine.toml",
        curveline.SurfaceRequest(curveline.Laying(2), curveline.FitRequest(is_planned=False)),
    )
    yield curveline.check_display("mine.toml")
    points = "".join(f"{x:g},{y:g}\n" for x, y in 1e3 * report[0].wanted.curve(50))
    Path("one.csv").write_text(f"x_mm,y_mm\n{points}")
    yield curveline.compare(curveline.read_trials([shape, "one.csv"]))
    trials = curveline.read_trials([Path(__file__).parent / "data" / "trials"], display="mine.toml")
    yield curveline.calibrate_rod(trials, curveline.CalibrationRequest("none"))
    curveline.new_keys()
    with curveline.connect("mock:keys", "mine.toml", runs=runs) as session:
        yield (adoption := session.find_devices())
        yield adoption.record()
        yield session.status()
        yield session.scan()
        yield session.channels(1.0)
        yield session.range(1, 1.0)
        yield session.dry_run(plan)
        yield session.send(plan)
        yield session.rod()
        yield session.stop()
        yield next(session.runs())
    Path("moved.toml").write_text(Path("mine.toml").read_text().replace("channel = 76", "channel = 90"))
    with (
        curveline.connect("mock:keys", "moved.toml", runs=runs) as moved,
        moved.new_settings([1], curveline.Formerly("mine.toml")) as change,
    ):
        yield change
    yield curveline.log("last", runs)
    (folder := Path("<i>roof")).mkdir()
    curveline.write(plan, folder / "plan.json")
    (folder / "lines.toml").write_text("[[lines]]\nname = '<b onclick=\"x()\">&amp;'\nplan = 'plan.json'\n")
    yield curveline.dry_run_lines(folder)
    yield curveline.send_lines(folder, "mock:fresh,keys", runs=runs)
    point = TradePoint(HOSTILE, "planar", "one level", 1.0, "edges", 10, 0.1, 1e-3, 1e-4, 2.0, right=1, cases=1)
    yield (report := BenchReport([Measurement(HOSTILE, 1.0, "us", "< 2", HOSTILE)], [point]))
    yield compare_bench(report, report)


def parsed(markup: str) -> ElementTree.Element:
    """The tree of HTML that is also XML; an error if a tag is left open, or a character stands for markup."""
    return ElementTree.fromstring(markup)


def test_every_kind_is_looked_at(results: dict[str, Any]) -> None:
    assert set(results) == DRAWN | TABLES
    offered = [getattr(curveline, name) for name in api_reference.public_names()]
    kinds = [*(each for each in offered if isinstance(each, type)), *api_reference.classes(offered)]
    assert {kind.__name__ for kind in kinds if hasattr(kind, "_repr_html_")} == DRAWN | TABLES


@pytest.mark.parametrize("kind", sorted(DRAWN | TABLES))
def test_html_is_whole_and_names_are_text(results: dict[str, Any], kind: str) -> None:
    html = results[kind]._repr_html_()
    tree = parsed(html)
    (table,) = tree.iter("table")
    widths = {len(row) for row in table}
    assert len(table) > 1
    assert len(widths) == 1, widths
    tags = {element.tag for element in tree.iter() if not element.tag.startswith("{")}
    assert tags <= {"div", "b", "table", "tr", "th", "td"}
    assert not [element for element in tree.iter("b") if element.attrib]
    assert "<i>" not in html
    assert "<script" not in html


@pytest.mark.parametrize("kind", sorted(DRAWN))
def test_figures_are_whole_and_names_are_text(results: dict[str, Any], kind: str) -> None:
    svg = results[kind]._repr_svg_()
    tree = parsed(svg)
    assert tree.tag == f"{SVG}svg"
    assert not [element for element in tree.iter() if element.tag == f"{SVG}script" or "onclick" in element.attrib]
    words = " ".join("".join(text.itertext()) for text in tree.iter(f"{SVG}text"))
    assert HOSTILE[:12] in words


@pytest.mark.parametrize("kind", ["DisplayCheck", "Plan", "ShapeReport", "Trials"])
def test_titles_have_the_name_as_it_is(results: dict[str, Any], kind: str) -> None:
    title = next(parsed(results[kind]._repr_html_()).iter("b")).text or ""
    assert HOSTILE in title


def test_what_goes_wrong_is_told_below(results: dict[str, Any]) -> None:
    assert "&lt;i&gt;nowhere.toml: there is no such file" in results["ShapeBatch"]._repr_html_()
    trials = results["Trials"]
    assert trials.reasons
    shown = "".join(parsed(trials._repr_html_()).itertext())
    assert all(each in shown for each in (*trials.reasons, trials.summary(), "fails with the smallest errors"))


def test_all_that_is_given_is_escaped() -> None:
    html = html_of(HOSTILE, [(HOSTILE, 1.23456), (HOSTILE, None)], remarks=[HOSTILE])
    assert [text for text in parsed(html).itertext() if text not in ("1.235", "None")] == [HOSTILE] * 4
