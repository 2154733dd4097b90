"""A wheel has all that an installed program needs: built, installed apart from the source tree, and used there."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

from curveline.shapes.library import builtin_shapes

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of a fresh environment into which nothing but the wheel was installed, beside what it depends on."""
    folder = tmp_path_factory.mktemp("wheel")
    offline = ["--no-build-isolation"] if importlib.util.find_spec("hatchling") else []
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", *offline, "--wheel-dir", folder, ROOT]
    subprocess.run(build, check=True, timeout=300)
    (wheel,) = folder.glob("curveline-*.whl")
    venv.create(folder / "venv", with_pip=False)
    python = folder / "venv" / "bin" / "python"
    where = subprocess.check_output([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], text=True)
    site = Path(where.strip())
    # The packages that it depends on are those of this environment, after what the wheel brings.
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", site, wheel]
    subprocess.run(install, check=True, timeout=300)
    return python


def said(python: Path, folder: Path, *arguments: str) -> str:
    """What a Python far from the source tree prints."""
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        [python, *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_wheel_brings_the_shapes_of_the_source_tree(installed: Path, tmp_path: Path) -> None:
    shapes = json.loads(said(installed, tmp_path, "-m", "curveline", "shapes", "--json"))["shapes"]
    home = str(installed.parents[1])
    assert [shape["name"] for shape in shapes] == list(builtin_shapes())
    for shape in shapes:
        assert shape["file"].startswith(home)
        assert Path(shape["file"]).read_bytes() == builtin_shapes()[shape["name"]].read_bytes()


def test_a_wheel_reads_built_in_shapes_and_displays_and_makes_new_ones(installed: Path, tmp_path: Path) -> None:
    code = "import curveline; print(curveline.__file__, curveline.read_shape('leaning').display.name)"
    where, name = said(installed, tmp_path, "-c", code).split()
    assert where.startswith(str(installed.parents[1]))
    assert name == "leaning"
    assert "span_mm" in said(installed, tmp_path, "-m", "curveline", "display", "show", "quad")
    said(installed, tmp_path, "-m", "curveline", "new", "display", "lab", "--nodes", "3")
    assert 'display = "lab.toml"' in said(
        installed, tmp_path, "-m", "curveline", "new", "shape", "--display", "lab.toml", "-o", "-"
    )


def test_a_wheel_finds_the_shapes_to_measure_with_and_the_yardstick(installed: Path, tmp_path: Path) -> None:
    code = (
        "from curveline.bench.measuring import own_shapes; from curveline.bench.methods import bare_newton; "
        "print(len(own_shapes()))"
    )
    assert said(installed, tmp_path, "-c", code) == "16\n"
