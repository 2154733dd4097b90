"""The compilers that the other tests rely on: found, told from each other, and not fooled by leftovers."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import pytest

from . import build


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "cache_folder", lambda: tmp_path)


@pytest.fixture
def source(tmp_path: Path) -> Path:
    folder = tmp_path / "source"
    folder.mkdir()
    (folder / "answer.h").write_text("#define ANSWER 42\n")
    path = folder / "answer.c"
    path.write_text('#include "answer.h"\nint answer(void);\nint answer(void) { return ANSWER; }\n')
    return path


def ask(library: Path) -> int:
    return int(ctypes.CDLL(str(library)).answer())


def test_a_library_is_built_once(source: Path) -> None:
    first = build.shared_library("answer", [source])
    assert ask(first) == 42
    before = first.stat().st_mtime_ns
    assert build.shared_library("answer", [source]) == first
    assert first.stat().st_mtime_ns == before


def test_a_changed_header_or_flag_is_another_product(source: Path) -> None:
    first = build.shared_library("answer", [source])
    assert build.shared_library("answer", [source], ["-DOTHER"]) != first
    source.with_name("answer.h").write_text("#define ANSWER 43\n")
    second = build.shared_library("answer", [source])
    assert (second != first, ask(second)) == (True, 43)


def test_a_spoiled_leftover_is_built_again(source: Path) -> None:
    first = build.shared_library("answer", [source])
    first.unlink()
    first.write_bytes(b"not a library")
    assert ask(build.shared_library("answer", [source])) == 42


def test_warnings_are_errors_and_the_compiler_is_quoted(source: Path) -> None:
    source.write_text("int answer(void);\nint answer(void) { int unused; return 42; }\n")
    with pytest.raises(build.CompilerError, match="unused"):
        build.shared_library("answer", [source])


def test_zig_serves_where_there_is_no_other_compiler(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(build.shutil, "which", lambda name: None)
    build.compiler.cache_clear()
    try:
        assert list(build.compiler()) == build.zig()
        assert ask(build.shared_library("answer", [source])) == 42
    finally:
        build.compiler.cache_clear()


def test_a_program_runs(source: Path) -> None:
    source.write_text("int main(void) { return 7; }\n")
    assert subprocess.run([build.executable("answer", [source])], check=False).returncode == 7
