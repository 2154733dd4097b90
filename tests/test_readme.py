"""Every command that README.md prints does what it says, typed as printed."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def _commands() -> list[str]:
    blocks = re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
    return [line for block in blocks for line in block.splitlines() if line.strip()]


INSTALLING = [command for command in _commands() if command.startswith("pip install")]
PLAIN = [command for command in _commands() if command not in INSTALLING]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder that looks like a fresh clone to the commands, with records of its own."""
    folder = tmp_path_factory.mktemp("clone")
    shutil.copytree(ROOT / "shapes", folder / "shapes")
    shutil.copytree(ROOT / "firmware", folder / "firmware", ignore=shutil.ignore_patterns("build"))
    return folder


def _run(command: str, place: Path) -> subprocess.CompletedProcess[str]:
    environment = {
        **os.environ,
        "CURVELINE_RUNS": str(place / "runs"),
        "CURVELINE_KEYS": str(place / "site.json"),
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
    }
    return subprocess.run(
        ["bash", "-c", command], cwd=place, env=environment, capture_output=True, text=True, timeout=300, check=False
    )


def test_first_screen_has_both_commands():
    assert INSTALLING == [
        "pip install -e . && curveline send shapes/level-up-peak.toml --radio mock --yes",
        "pip install -e '.[test]' && pytest",
    ]
    first_screen = "\n".join(README.splitlines()[:30])
    assert all(command in first_screen for command in INSTALLING)


def test_the_main_job_arrives_at_the_wanted_curve(place):
    done = _run(INSTALLING[0].split("&& ")[1], place)
    assert done.returncode == 0, done.stderr
    assert "peak" in done.stdout + done.stderr


@pytest.mark.parametrize("command", PLAIN)
def test_command_runs_as_printed(command, place):
    done = _run(command, place)
    assert done.returncode == 0, done.stderr
    assert done.stdout or "-o " in command
    assert "Traceback" not in done.stderr


def test_ci_runs_the_printed_test_command():
    script = (ROOT / ".ci" / "run").read_text()
    assert "grep -m 1 '&& pytest$' README.md" in script


def test_python_example_runs(place):
    example = re.search(r"```python\n(.*?)```", README, re.DOTALL).group(1)
    done = subprocess.run(
        [sys.executable, "-c", example], cwd=place, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "peak" in done.stdout
    assert "valley" in done.stdout


def test_example_shape_is_the_file_it_names():
    example = re.search(r"```toml\n(.*?)```", README, re.DOTALL).group(1)
    from curveline import read_shape

    file = ROOT / "shapes" / "level-up-peak.toml"
    assert read_shape(file).name == "level-up-peak"
    for line in example.splitlines():
        bare = re.sub(r"\s+", "", line.split("#")[0])
        assert bare in re.sub(r"\s+", "", re.sub(r"#.*", "", file.read_text())), line
