"""A node's program replaced over the air, on the mock: bad air, a host that is broken off anywhere, what is refused."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

import curveline
from curveline.errors import CurvelineError, InvalidInput, LinkError
from curveline.radio.interface import Answer
from programs import updatable_hex


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "updatable.hex"
    path.write_text(updatable_hex())
    return path


@pytest.mark.parametrize("spec", ["mock", "mock:loss=0.3", "mock:loss=0.3,dup=0.1,stale=0.1,corrupt=0.05"])
def test_a_program_arrives_over_bad_air(program: Path, tmp_path: Path, spec: str) -> None:
    parts: list[float] = []
    with curveline.connect(spec, runs=tmp_path / "runs") as session:
        before = session.node(1).report()
        done = session.node(1).update(program, seen=parts.append)
        after = session.node(1).report()
    assert (done.was, done.firmware) == (4, 5)
    assert parts == sorted(parts)
    assert parts[-1] == 1.0
    assert after.axes == before.axes == (0, 0, 0), "the position is kept"
    assert after.boot == before.boot + 2


class Cut(Exception):
    """Somebody breaks the host off."""


@pytest.mark.parametrize("at", [*range(0, 60, 3), *range(60, 260, 16)])
def test_broken_off_at_any_frame_the_same_command_goes_on(program: Path, tmp_path: Path, at: int) -> None:
    with curveline.connect("mock:loss=0.1", runs=tmp_path / "runs") as session:
        node = session.node(1)
        exchange, count = node.radio.exchange, 0

        def cut(frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
            nonlocal count
            count += 1
            if count == at + 1:
                raise Cut
            return exchange(frames)

        node.radio.exchange = cut  # type: ignore[method-assign]
        with pytest.raises(Cut):
            node.update(program)
        done = node.update(program)
        assert done.firmware == 5
        assert done.was in (4, 5, None)
        assert node.info().firmware == 5


def test_what_is_there_is_not_sent_again(program: Path, tmp_path: Path) -> None:
    with curveline.connect("mock", runs=tmp_path / "runs") as session:
        node = session.node(2)
        first = node.update(program)
        again = node.update(program)
        assert again.frames < 20 < 3 * 64 <= first.frames < 3 * 64 + 60


def test_an_older_program_needs_a_word(program: Path, tmp_path: Path) -> None:
    old = tmp_path / "old.hex"
    old.write_text(updatable_hex(4))
    with curveline.connect("mock", runs=tmp_path / "runs") as session:
        node = session.node(1)
        node.update(program)
        with pytest.raises(InvalidInput, match="an older one: 4") as caught:
            node.update(old)
        assert "--older" in (caught.value.hint or "")
        assert node.info().firmware == 5
        assert node.update(old, older=True).firmware == 4


def test_a_program_for_other_settings_is_refused_and_the_node_is_as_before(tmp_path: Path) -> None:
    other = tmp_path / "other.hex"
    other.write_text(updatable_hex(settings=2))
    with curveline.connect("mock", runs=tmp_path / "runs") as session:
        node = session.node(1)
        with pytest.raises(LinkError, match="its settings are not of the kind"):
            node.update(other)
        session.node(2).report()
        assert node.info().firmware == 4


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("mock:firmware=1", "has firmware"),
        ("mock:noloader=1", "has no loader"),
        ("mock:away=1", "does not answer"),
        ("mock:key=1", "not to the key"),
    ],
)
def test_what_cannot_be_updated_says_why(program: Path, tmp_path: Path, spec: str, words: str) -> None:
    with (
        curveline.connect(spec, runs=tmp_path / "runs") as session,
        pytest.raises(CurvelineError, match=words),
    ):
        session.node(1).update(program)


@pytest.mark.parametrize("text", ["", ":00000001FF\n", "display = 'single'\n"])
def test_a_file_that_is_no_program_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.hex"
    path.write_text(text)
    with curveline.connect("mock", runs=tmp_path / "runs") as session, pytest.raises(InvalidInput):
        session.node(1).update(path)
