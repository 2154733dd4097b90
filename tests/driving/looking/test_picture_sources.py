"""Where pictures come from: commands, folders, and what is said when none does."""

from __future__ import annotations

import shlex
import sys
import threading
import time
from pathlib import Path

import pytest

from curveline.driving.looking import picture_sources
from curveline.driving.looking.picture_sources import CommandCamera, FolderCamera, NoPicture, open_source
from curveline.errors import InvalidInput


def silent(text: str) -> None:
    pass


def python(code: str) -> str:
    """A command that runs some Python with the picture's file as its argument."""
    return f"{shlex.quote(sys.executable)} -c {shlex.quote(code)} {{}}"


def test_a_command_takes_a_picture_where_it_is_told(tmp_path: Path) -> None:
    source = open_source(python("import sys; open(sys.argv[1], 'wb').write(b'x')"), silent)
    assert isinstance(source, CommandCamera)
    assert source.take(tmp_path / "look-1") == tmp_path / "look-1.jpg"
    assert (tmp_path / "look-1.jpg").read_bytes() == b"x"


def test_no_shell_reads_a_command(tmp_path: Path) -> None:
    source = open_source("true {} ; touch " + str(tmp_path / "harm"), silent)
    with pytest.raises(NoPicture):
        source.take(tmp_path / "look")
    assert not (tmp_path / "harm").exists()


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (python("import sys; sys.exit('no lens')"), "no lens"),
        (python("pass"), "left no picture"),
        ("/nowhere/camera {}", "cannot be run"),
    ],
)
def test_a_command_that_fails_says_why(tmp_path: Path, command: str, said: str) -> None:
    with pytest.raises(NoPicture, match=said) as refused:
        open_source(command, silent).take(tmp_path / "look")
    assert refused.value.hint


def test_a_command_that_hangs_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(picture_sources, "COMMAND_S", 0.2)
    with pytest.raises(NoPicture, match=r"within 0\.2 s"):
        open_source(python("import time; time.sleep(30)"), silent).take(tmp_path / "look")


@pytest.mark.parametrize("source", ["camera", "", 'camera "{}'])
def test_neither_a_folder_nor_a_command(source: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        open_source(source, silent)
    assert refused.value.hint


def test_a_folder_gives_the_picture_that_is_new(tmp_path: Path) -> None:
    (tmp_path / "old.jpg").write_bytes(b"old")
    heard: list[str] = []
    source = open_source(str(tmp_path), heard.append)
    assert isinstance(source, FolderCamera)

    def photographer() -> None:
        time.sleep(0.3)
        with (tmp_path / "new.jpg").open("wb") as stream:
            for _ in range(3):
                stream.write(b"part")
                stream.flush()
                time.sleep(0.2)

    thread = threading.Thread(target=photographer)
    thread.start()
    found = source.take(tmp_path / "elsewhere")
    thread.join()
    assert found == tmp_path / "new.jpg"
    assert found.read_bytes() == b"part" * 3
    assert heard == [f"waiting for a picture in {tmp_path}"]


def test_a_folder_into_which_none_comes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "notes.txt").write_text("no picture")
    monkeypatch.setattr(picture_sources, "ARRIVES_S", 0.3)
    with pytest.raises(NoPicture, match="no new picture"):
        open_source(str(tmp_path), silent).take(tmp_path / "x")


def test_a_folder_that_went_away(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    source = open_source(str(gone), silent)
    gone.rmdir()
    with pytest.raises(NoPicture, match="cannot be looked into"):
        source.take(tmp_path / "x")
