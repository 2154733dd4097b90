"""Every command that README.md prints does what it says, typed as printed, and prints what is shown."""

from pathlib import Path

import printed
import pytest

import standby

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
BLOCKS = printed.blocks(ROOT / "README.md")
INSTALLING = [line for block in BLOCKS if block.kind == "sh" for line in block.text.splitlines()]
SHOWN = [block for block in BLOCKS if block.kind == "console"]


@pytest.fixture
def place(tmp_path):
    """A folder that looks like a fresh clone to the commands, with records of its own."""
    return printed.clone(tmp_path / "clone")


def _sh(command: str) -> printed.Block:
    return printed.Block("sh", command, "", (0, 0))


def test_first_screen_has_both_commands():
    assert INSTALLING == [
        "pip install -e . && curveline send shapes/level-up-peak.toml --radio mock --yes",
        "pip install -e '.[test]' && pytest",
    ]
    first_screen = "\n".join(README.splitlines()[:30])
    assert all(command in first_screen for command in INSTALLING)


def test_the_main_job_arrives_at_the_wanted_curve(place):
    done = printed.run(_sh(INSTALLING[0].split("&& ")[1]), place)
    assert done.code == 0, done.err
    assert "the rod is in the peak, as wanted" in done.out


def test_three_commands_are_shown():
    assert len(SHOWN) == 3
    assert len(README.splitlines()) <= 100


@pytest.fixture
def _standby(monkeypatch, tmp_path):
    monkeypatch.setattr(printed, "PYTHON", standby.python())
    monkeypatch.setattr(printed, "COMMANDS", standby.commands(tmp_path / "bin"))


@pytest.mark.usefixtures("_standby")
@pytest.mark.parametrize("block", SHOWN, ids=[block.text.splitlines()[0].split()[2] for block in SHOWN])
def test_command_prints_what_is_shown(block, place):
    done = printed.run(block, place)
    assert done.out
    assert not (found := printed.differences(block, done)), "\n".join(found)


def test_ci_runs_the_printed_test_command():
    script = (ROOT / ".ci" / "run").read_text()
    assert "grep -m 1 '&& pytest$' README.md" in script


@pytest.mark.usefixtures("_standby")
def test_python_example_runs(place):
    (example,) = [block for block in BLOCKS if block.kind == "python"]
    assert len(example.text.splitlines()) <= 12
    done = printed.run(example, place)
    assert done.code == 0, done.err
    assert "peak: the middle is at 0.1991 m" in done.out
    assert "valley" in done.out


def test_the_picture_comes_first():
    assert README.split("\n\n")[1].startswith("![")
