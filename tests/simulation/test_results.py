"""The JSON document field by field, the other formats against it, and writing that is whole or not at all."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import curveline
from curveline.rod.models.model_error import Bound
from curveline.simulation import results
from curveline.simulation.results import Settings, ShapeReport

SHAPES = Path(__file__).parents[2] / "shapes"
STATE_FIELDS = {
    "name": str,
    "stable": bool,
    "wanted": bool,
    "simple": bool,
    "outcome": str,
    "energy_mJ": float,
    "error_mm": float,
    "vertices": int,
    "iterations": int,
    "lowest_eigenvalue": float,
    "winding": int,
    "crosses_itself": bool,
    "wraps_clamp": bool,
    "leaves_plane": bool,
    "mean_height_mm": float,
    "clearance_mm": float,
    "max_curvature_per_m": float,
    "curve_mm": list,
    "clamp_force_N": list,
    "clamp_moment_Nmm": list,
}
SPACE_FIELDS = {"depth_mm", "max_depth_mm", "clamp_force_xyz_N", "clamp_moment_xyz_Nmm"}
QUAD = """
name = "wave"
display = "quad"
nodes = [
  { height_mm = 0.0, angle_deg = 30.0 }, { height_mm = 51.3, angle_deg = 0.0 },
  { height_mm = -49.7, angle_deg = -30.0 }, { height_mm = 0.1, angle_deg = 0.0 }, { height_mm = 0.0, angle_deg = 0.0 },
]
segments = [
  { length_mm = 620.0, state = "peak" }, { length_mm = 600.0, state = "valley" },
  { length_mm = 640.0, state = "peak" }, { length_mm = 700.0, state = "peak" },
]
loads = [ { segment = 2, at = 0.4, force_N = [0.0, -1.0] } ]
"""


def report_on(path: Path, settings: Settings | None = None) -> ShapeReport:
    settings = settings or Settings(argv=("simulate", "shape.toml"))
    scene = curveline.read_shape(path)
    segments = curveline.simulate(scene, settings.tolerance, settings.windings, settings.model)
    return ShapeReport(scene, tuple(segments), settings, 0.25)


@pytest.fixture(scope="module")
def peak() -> ShapeReport:
    return report_on(SHAPES / "level-up-peak.toml")


@pytest.fixture(scope="module")
def staggered() -> ShapeReport:
    return report_on(SHAPES / "staggered-asymmetric-valley.toml", Settings(windings=(0, 1, -1), points=21))


@pytest.fixture(scope="module")
def twisted() -> ShapeReport:
    return report_on(SHAPES / "space" / "twisted.toml", Settings(points=21, explained=True))


@pytest.fixture(scope="module")
def wave(tmp_path_factory: pytest.TempPathFactory) -> ShapeReport:
    path = tmp_path_factory.mktemp("wave") / "wave.toml"
    path.write_text(QUAD)
    return report_on(path)


def test_the_document_is_the_one_of_the_design(peak: ShapeReport) -> None:
    document = results.document(peak)
    assert list(document)[:5] == ["curveline", "shape", "tolerance_mm", "seconds", "segments"]
    assert document["curveline"] == curveline.__version__
    assert document["shape"] == "level-up-peak"
    assert document["tolerance_mm"] == pytest.approx(0.1)
    assert document["seconds"] == 0.25
    (segment,) = document["segments"]
    assert segment["length_mm"] == 660.0
    assert segment["wanted"] == "peak"
    model = segment["model"]
    assert model["kind"] == "planar"
    assert model["terms"] == ["bend", "gravity"]
    assert {"stretch", "twist", "contact"} <= set(model["left_out"])
    for bound in model["left_out"].values():
        assert set(bound) == {"bound_mm", "why"}
        assert bound["bound_mm"] >= 0.0
        assert bound["why"]


def test_every_state_has_every_field_as_a_plain_type(staggered: ShapeReport) -> None:
    (segment,) = results.document(staggered)["segments"]
    assert {state["winding"] for state in segment["states"]} > {0}
    for state in segment["states"]:
        assert set(state) == set(STATE_FIELDS)
        for name, kind in STATE_FIELDS.items():
            assert type(state[name]) is kind or (name == "clearance_mm" and state[name] is None), name
        assert np.array(state["curve_mm"]).shape == (21, 2)
        assert np.array(state["clamp_force_N"]).shape == (2, 2)
        assert np.array(state["clamp_moment_Nmm"]).shape == (2,)
        assert state["simple"] is not (state["winding"] != 0 or state["crosses_itself"] or state["wraps_clamp"])
    assert [state["name"] for state in segment["states"] if state["wanted"]] == ["valley"]


def test_numbers_are_the_states_own_in_the_units_of_their_names(peak: ShapeReport) -> None:
    for state, record in zip(peak.segments[0].states, results.document(peak)["segments"][0]["states"], strict=True):
        assert record["energy_mJ"] == pytest.approx(1e3 * state.energy, rel=1e-15)
        assert record["error_mm"] == pytest.approx(1e3 * state.error, rel=1e-15)
        assert record["mean_height_mm"] == pytest.approx(1e3 * state.mean_height, rel=1e-15)
        assert record["clamp_moment_Nmm"] == pytest.approx((1e3 * state.clamp_moment).tolist(), rel=1e-15)
        assert record["clamp_force_N"] == state.clamp_force.tolist()
        assert record["lowest_eigenvalue"] == state.lowest_eigenvalue


def test_a_state_in_space_has_depth_and_forces_in_three_components(twisted: ShapeReport) -> None:
    (segment,) = results.document(twisted)["segments"]
    assert segment["model"]["kind"] == "spatial"
    assert {"bend", "stretch", "twist", "gravity"} <= set(segment["model"]["terms"])
    assert not {"stretch", "twist"} & set(segment["model"]["terms"]) & set(segment["model"]["left_out"])
    for state, record in zip(twisted.segments[0].states, segment["states"], strict=True):
        assert set(record) == set(STATE_FIELDS) | SPACE_FIELDS
        assert record["depth_mm"] == (1e3 * state.depth(21)).tolist()
        assert record["depth_mm"][0] == record["depth_mm"][-1] == 0.0
        assert 30.0 < max(map(abs, record["depth_mm"])) <= record["max_depth_mm"]
        forces, moments = np.array(record["clamp_force_xyz_N"]), np.array(record["clamp_moment_xyz_Nmm"])
        assert forces[:, :2].tolist() == record["clamp_force_N"]
        assert moments[:, 2] == pytest.approx(record["clamp_moment_Nmm"], rel=1e-14)
        weight = twisted.scene.display.rod.weight_per_length * state.rod.free_length
        assert forces.sum(axis=0) == pytest.approx([0.0, weight, 0.0], abs=1e-6)
        # The clamps also balance about the viewer's axis of the left free end.
        assert np.abs(moments[:, 0]).max() > 10.0
    assert json.loads(results.to_json([twisted]))["provenance"]["settings"]["model"] == "auto"


def test_an_explanation_is_sentences_of_what_was_modelled_and_how_well(twisted: ShapeReport, peak: ShapeReport) -> None:
    (segment,) = results.document(twisted)["segments"]
    sentences = segment["model"]["explanation"]
    assert len(sentences) >= 2
    assert all(sentence[0].isupper() and sentence.endswith(".") for sentence in sentences)
    assert re.search(r"peak and valley are known to 0\.0\d+ mm, estimated from up to \d+ vertices", sentences[-1])
    assert "explanation" not in results.document(peak)["segments"][0]["model"]


def test_what_is_not_known_is_null_in_json_and_infinite_in_npz(peak: ShapeReport) -> None:
    from dataclasses import replace

    segment = peak.segments[0]
    lost = replace(segment.states[0], error=math.inf, lowest_eigenvalue=math.nan)
    report = replace(peak, segments=(replace(segment, states=(lost,)),))
    record = json.loads(results.to_json([report]))["segments"][0]["states"][0]
    assert (record["error_mm"], record["lowest_eigenvalue"]) == (None, None)
    with np.load(io.BytesIO(results.to_npz([report]))) as arrays:
        assert (arrays["error_mm"][0], arrays["lowest_eigenvalue"][0]) == (math.inf, math.inf)


def test_a_model_that_was_asked_for_and_leaves_out_too_much_is_remarked_on(peak: ShapeReport) -> None:
    from dataclasses import replace

    assert peak.remarks == ()
    segment = peak.segments[0]
    rough = replace(segment, left_out={**segment.left_out, "twist": Bound(0.0382, "why not")})
    asked = replace(peak, segments=(rough,), settings=replace(peak.settings, model="planar"))
    assert asked.remarks == ("segment 1: the planar model leaves out twist, which may move it by 38 mm",)
    assert replace(asked, settings=peak.settings).remarks == ()


def test_json_keeps_every_digit(peak: ShapeReport) -> None:
    document = results.document(peak)
    assert json.loads(results.to_json([peak])) == document


def test_curves_lead_from_pivot_to_pivot_to_the_last_bit(wave: ShapeReport) -> None:
    heights = [0.0, 51.3, -49.7, 0.1, 0.0]
    for index, segment in enumerate(results.document(wave)["segments"]):
        assert segment["states"]
        for state in segment["states"]:
            curve = np.array(state["curve_mm"])
            assert curve.shape == (201, 2)
            assert curve[0].tolist() == [500.0 * index, heights[index]]
            assert curve[-1].tolist() == [500.0 * (index + 1), heights[index + 1]]
            steps = np.hypot(*np.diff(curve, axis=0).T)
            assert steps == pytest.approx(segment["length_mm"] / 200, rel=1e-2)
            # A straight stretch in the bearing: the second point lies on the tangent of the first.
            assert steps[0] == pytest.approx(segment["length_mm"] / 200, rel=1e-9)
    assert results.document(wave)["segments"][1]["model"]["terms"] == ["bend", "gravity", "loads"]


def test_provenance_tells_where_a_result_comes_from(peak: ShapeReport) -> None:
    provenance = results.document(peak)["provenance"]
    assert set(provenance["versions"]) == {"curveline", "python", "numpy", "numba", "scipy"}
    path = SHAPES / "level-up-peak.toml"
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert provenance["shape"] == {"path": str(path), "sha256": digest}
    assert provenance["display"] == {"name": "single", "sha256": peak.scene.display.digest}
    tolerance = pytest.approx(0.1)
    assert provenance["settings"] == {"tolerance_mm": tolerance, "points": 201, "windings": [0], "model": "auto"}
    assert provenance["argv"] == ["simulate", "shape.toml"]


def test_npz_holds_one_row_per_state(peak: ShapeReport, staggered: ShapeReport) -> None:
    reports = [peak, report_on(SHAPES / "level-up-valley.toml")]
    with np.load(io.BytesIO(results.to_npz(reports)), allow_pickle=False) as arrays:
        stored: dict[str, Any] = {name: arrays[name] for name in arrays.files}
    described = str(results.to_npz.__doc__)
    assert [name for name in stored if not re.search(rf"\b{name}\b", described)] == []
    assert stored["shape"].tolist() == ["level-up-peak"] * 2 + ["level-up-valley"] * 2
    assert stored["state"].tolist() == ["peak", "valley"] * 2
    assert stored["wanted"].tolist() == [True, False, False, True]
    assert stored["curve_mm"].shape == (4, 201, 2)
    assert stored["clamp_force_N"].shape == (4, 2, 2)
    records = [state for report in reports for state in results.document(report)["segments"][0]["states"]]
    for name in ("energy_mJ", "error_mm", "lowest_eigenvalue", "winding", "curve_mm", "clamp_moment_Nmm"):
        assert np.array_equal(stored[name], [record[name] for record in records]), name
    document = json.loads(str(stored["document"][0]))
    assert document["provenance"] == results.document(peak)["provenance"]
    assert "curve_mm" not in document["segments"][0]["states"][0]


def test_csv_holds_one_row_per_point(staggered: ShapeReport) -> None:
    rows = list(csv.DictReader(io.StringIO(results.to_csv([staggered]).decode())))
    states = results.document(staggered)["segments"][0]["states"]
    assert len(rows) == 21 * len(states)
    for state, start in zip(states, range(0, len(rows), 21), strict=True):
        part = rows[start : start + 21]
        assert {row["state"] for row in part} == {state["name"]}
        assert {row["simple"] for row in part} == {str(state["simple"]).lower()}
        assert [[float(row["x_mm"]), float(row["y_mm"])] for row in part] == state["curve_mm"]
        assert {row["z_mm"] for row in part} == {"0.0"}
        assert float(part[-1]["arc_length_mm"]) == 720.0
        assert [int(row["point"]) for row in part] == list(range(21))


def test_tables_hold_the_third_coordinate(twisted: ShapeReport) -> None:
    flat = report_on(SHAPES / "level-up-peak.toml", twisted.settings)
    states = results.document(twisted)["segments"][0]["states"]
    rows = list(csv.DictReader(io.StringIO(results.to_csv([twisted]).decode())))
    assert [float(row["z_mm"]) for row in rows] == [depth for state in states for depth in state["depth_mm"]]
    with np.load(io.BytesIO(results.to_npz([flat, twisted])), allow_pickle=False) as arrays:
        assert arrays["model"].tolist() == ["planar", "planar", "spatial", "spatial"]
        assert np.array_equal(arrays["depth_mm"], [[0.0] * 21] * 2 + [state["depth_mm"] for state in states])
        assert np.array_equal(arrays["max_depth_mm"], [0.0, 0.0] + [state["max_depth_mm"] for state in states])
        assert not arrays["leaves_plane"].any()
        assert "depth_mm" not in json.loads(str(arrays["document"][1]))["segments"][0]["states"][0]


def test_a_scene_without_any_state_can_be_written(peak: ShapeReport) -> None:
    from dataclasses import replace

    empty = replace(peak, segments=(replace(peak.segments[0], states=()),))
    assert empty.shortfalls == ("segment 1 has no peak; its stable states: none at all",)
    assert results.document(empty)["segments"][0]["states"] == []
    assert results.to_csv([empty]).count(b"\n") == 1
    with np.load(io.BytesIO(results.to_npz([empty]))) as arrays:
        assert arrays["energy_mJ"].shape == (0,)
