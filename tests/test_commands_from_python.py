"""What only commands could do, from Python: the same answers as the command line gives, as data."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import curveline
from curveline.bench import link, measuring, trade
from curveline.bench.measurement import Measurement
from curveline.bench.methods import cases
from curveline.bench.methods.own import OWN, Method
from curveline.bench.quick import FigureGroup
from curveline.cli.app import app
from curveline.errors import InvalidInput
from curveline.shapes.files import builtin_text

SHAPES = Path(__file__).parents[1] / "shapes"
Said = Callable[..., str]


@pytest.fixture(autouse=True)
def _here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def said() -> Said:
    """What a command prints on stdout."""

    def said(*words: object) -> str:
        done = CliRunner().invoke(app, list(map(str, words)), catch_exceptions=False)
        assert done.exit_code == 0, done.output
        return done.stdout

    return said


def document(text: str) -> Any:
    return json.loads(text)


def test_a_display_is_checked(said: Said) -> None:
    checked = curveline.check_display("single")
    assert checked.document() == document(said("display", "check", "single", "--json"))
    assert checked.ability.held.longest == pytest.approx(0.9)
    own = Path("own.toml")
    own.write_text(builtin_text("single").replace("clamp_mm = 20.0", "clamp_mm = 150.0"))
    (warning, *_) = curveline.check_display(own).warnings
    assert warning.key
    assert curveline.check_display(curveline.read_display(own)).warnings[0] == warning
    assert warning.message.split(";")[0] in said("display", "check", own).replace("\n  ", " ")
    own.write_text("nodes = 1\n")
    with pytest.raises(InvalidInput):
        curveline.check_display(own)


def test_files_to_begin_with_are_those_of_the_command(said: Said) -> None:
    text = curveline.new_display("lab.toml", 3)
    assert Path("lab.toml").read_text() == text == said("new", "display", "lab", "--nodes", 3, "-o", "-")
    assert curveline.check_display("lab.toml").display.node_count == 3
    Path("shapes").mkdir()
    curveline.new_shape("shapes/arch.toml", "lab.toml", "valley")
    scene = curveline.read_shape("shapes/arch.toml")
    assert (scene.name, scene.display.name) == ("arch", "lab")
    assert [segment.state for segment in scene.segments] == ["valley"] * 2
    assert curveline.new_shape(None, name="arch") == said("new", "shape", "arch", "-o", "-")
    assert not Path("my-shape.toml").exists()
    for new in (curveline.new_shape, curveline.new_display):
        with pytest.raises(InvalidInput, match="exists already"):
            new("lab.toml")
    assert Path("lab.toml").read_text() == text
    with pytest.raises(InvalidInput, match="no new shape has a state 'hill'"):
        curveline.new_shape("odd.toml", state="hill")
    assert not Path("odd.toml").exists()


def test_what_is_built_in_is_listed(said: Said) -> None:
    listed = document(said("shapes", "--json"))["shapes"]
    assert {each["name"]: each["file"] for each in listed} == {
        name: str(file) for name, file in curveline.builtin_shapes().items()
    }
    assert curveline.builtin_displays() == ("quad", "single")
    assert curveline.builtin_text("quad") == said("display", "show", "quad")


HEX = ":0800000000180020C1000000FF\n:00000001FF\n"


class Notes(curveline.RunListener):
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.told: list[str] = []

    def note(self, text: str) -> None:
        """See Listener."""
        self.told.append(text)


def test_keys_are_made_put_into_a_node_and_adopted(said: Said, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CURVELINE_KEYS", "site.json")
    site = curveline.new_keys()
    assert curveline.read_keys() == site
    assert curveline.read_keys("site.json").document() == document(said("keys", "show", "--json"))
    with pytest.raises(InvalidInput, match="exists already"):
        curveline.new_keys()
    with curveline.connect("mock:keys", runs="runs") as session:
        adoption = session.find_devices()
        assert curveline.read_keys().chips == {}
        assert adoption.record().chips == curveline.read_keys().chips
        assert session.status().is_well
        assert [row[-1] for row in session.find_devices().rows()] == ["as before", "as before"]
    shown = "".join(each._repr_html_() for each in (adoption, curveline.read_keys()))
    assert site.fingerprint in shown
    assert site.master.hex() not in shown
    Path("node.hex").write_text(HEX)
    image = curveline.node_image(2, "node.hex", "node2.hex")
    said("keys", "node", 2, "--hex", "node.hex", "-o", "same.hex")
    assert Path("node2.hex").read_bytes() == Path("same.hex").read_bytes()
    assert (image.node, image.display, image.address) == (2, "single", "C1C1C1C102")
    for number, path, message in ((3, "node3.hex", "there is no node 3"), (1, "node2.hex", "exists already")):
        with pytest.raises(InvalidInput, match=message):
            curveline.node_image(number, "node.hex", path)


def test_who_listens_is_told_of_a_key_that_would_be_committed() -> None:
    subprocess.run(["git", "init", "-q"], check=True)
    notes = Notes()
    curveline.new_keys("keys.json", notes)
    (told,) = notes.told
    assert told.startswith("warning: keys.json holds the site's key")


PAIR = ("level-up-peak", "level-up-valley")


def without(value: Any, *keys: str) -> Any:
    """Plain data without what is another one each time."""
    if isinstance(value, dict):
        return {key: without(each, *keys) for key, each in value.items() if key not in keys}
    return [without(each, *keys) for each in value] if isinstance(value, list) else value


def test_many_shapes_are_simulated_on_several_processes(said: Said) -> None:
    heard = Notes()
    Path("turned.toml").write_text((SHAPES / "level-up-peak.toml").read_text().replace("30.0", "0.52"))
    Path("broken.toml").write_text("name = 3\n")
    shapes = [*PAIR, "broken.toml", curveline.read_shape("roofline"), "turned.toml"]
    batch = curveline.simulate_many(shapes, curveline.Settings(points=11), jobs=2, listener=heard)
    assert [each.shape for each in batch][:3] == [*PAIR, "broken.toml"]
    assert [each.is_as_wanted for each in batch] == [True, True, False, True, True]
    assert list(batch.failed) == ["broken.toml"]
    assert batch[2].report is None
    assert isinstance(batch[2].error, InvalidInput)
    assert heard.told[0].startswith("turned.toml: is angle_deg in radians?")
    lines = said("simulate", *PAIR, "--json", "-p", 11).splitlines()
    assert [without(each.document(), "seconds", "argv") for each in batch.reports[:2]] == [
        without(document(line), "seconds", "argv") for line in lines
    ]
    curveline.write(batch, "all.csv")
    curveline.write(batch.reports, "same.csv")
    assert Path("all.csv").read_text() == Path("same.csv").read_text()
    assert Path("all.csv").read_text().count("\nlevel-up-valley,1,valley,") == 11


def test_a_shape_without_its_state_is_advised_and_explained(said: Said) -> None:
    Path("flat.toml").write_text((SHAPES / "level-up-peak.toml").read_text().replace('"peak"', '"valley"', 1))
    Path("flat.toml").write_text(Path("flat.toml").read_text().replace("30.0", "60.0"))
    (answer,) = curveline.simulate_many(["flat.toml"])
    assert not answer.is_as_wanted
    assert answer.advice
    done = CliRunner().invoke(app, ["simulate", "flat.toml"])
    assert answer.advice[0].split(",")[0] in " ".join(done.stderr.split())
    (segment,) = curveline.simulate("level-up-peak")
    explained = " ".join(said("simulate", "level-up-peak", "--explain").split())
    assert all(sentence in explained for sentence in curveline.explain(segment))


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_sweep_is_kept_in_every_file_of_the_command(said: Said, jobs: int) -> None:
    settings = curveline.Settings(points=7)
    report = curveline.sweep("level-up-peak", {"nodes.1.angle_deg": (0.0, 30.0, 3)}, settings, jobs)
    files = [f"there.{suffix}" for suffix in ("json", "npz", "csv", "svg")]
    words = [word for file in files for word in ("-o", file)]
    said("simulate", "level-up-peak", "--sweep", "nodes.1.angle_deg=0:30:3", "-p", 7, "--plot", "energy_mJ", *words)
    for file in files:
        curveline.write(report, file.replace("there", "here"), plot="energy_mJ" if file.endswith("svg") else "")
    assert Path("here.csv").read_text() == Path("there.csv").read_text()
    here, there = (
        [without(document(line), "seconds", "argv") for line in Path(name).read_text().splitlines()]
        for name in ("here.json", "there.json")
    )
    assert here == there
    with np.load("here.npz") as mine, np.load("there.npz") as its:
        assert mine["curve_mm"].shape == (len(report.rows), 7, 2)
        assert {*mine} == {*its}
        for name in {*mine} - {"settings"}:
            assert np.array_equal(mine[name], its[name]), name
    assert "energy" in Path("here.svg").read_text()
    assert [dict(point.swept) for point in report.points] == [{"nodes.1.angle_deg": angle} for angle in (0, 15, 30)]
    curveline.write(report, "coarse.npz", points=3)
    with np.load("coarse.npz") as coarse:
        assert coarse["curve_mm"].shape[1] == 3


def test_what_cannot_be_plotted_is_refused() -> None:
    report = curveline.sweep("level-up-peak", {"nodes.1.angle_deg": (0.0, 30.0, 2)})
    with pytest.raises(InvalidInput, match="states have no such number"):
        curveline.write(report, "x.svg", plot="colour")
    with pytest.raises(InvalidInput, match="for the figure of a sweep only"):
        curveline.write(report, "x.csv", plot="energy_mJ")
    with pytest.raises(InvalidInput, match="for the figure of a sweep only"):
        curveline.write(report.points[0].report, "x.svg", plot="energy_mJ")
    assert not list(Path().iterdir())


def test_the_benchmark_measures_what_the_command_does(monkeypatch: pytest.MonkeyPatch) -> None:
    figure = Measurement("one state", 3.0, "us", "< 2", "from a guess")
    asked: list[Sequence[str]] = []

    def goals(shapes: Sequence[str]) -> list[FigureGroup]:
        asked.append(shapes)
        return [FigureGroup("one rod", lambda: iter([figure]))]

    monkeypatch.setattr(measuring, "goals", goals)
    methods = [Method(**{**vars(OWN[0]), "settings": OWN[0].settings[:2]})]
    monkeypatch.setattr(measuring, "trade_jobs", lambda shapes: trade.jobs([cases.shapes(shapes)], methods))
    file = str(curveline.builtin_shapes()["level-up-peak"])
    heard: list[int] = []

    class Counting(curveline.Listener):
        @contextmanager
        def progress(self, what: str, total: int | None) -> Iterator[Callable[[int], object]]:
            yield heard.append

    report = curveline.measure([file], listener=Counting())
    assert (asked, list(report.rows)) == ([[file]], [figure])
    assert [point.setting for point in report.points] == list(methods[0].settings)
    assert heard == [1, 0, 1]
    curveline.write(report, "trade.json")
    assert document(Path("trade.json").read_text()) == report.document()
    curveline.write(report, "trade.svg")
    assert curveline.measure([file], quick=True).points == []
    curveline.measure(quick=True)
    assert len(asked[-1]) == len([name for name in curveline.builtin_shapes() if "-" in name]) > 1


def test_the_link_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    figure = Measurement("polls", 100.0, "/s", "", "model")
    monkeypatch.setattr(link, "rows", lambda: [figure])
    assert curveline.measure_link() == [figure]
