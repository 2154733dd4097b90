"""Journals: cut anywhere, damaged anywhere, and disks that refuse."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from random import Random

import pytest

from curveline.errors import InvalidInput, LinkError
from curveline.radio import journal as journal_module
from curveline.radio.journal import Journal, SystemDisk, encode_record, new_run, read_journal, runs_folder

RECORDS = [{"type": "start", "run": "00ff", "steps": [[1, [2, 3]]]}]
for _step in range(1, 6):
    RECORDS += [{"type": "release", "step": _step}, {"type": "barrier", "step": _step, "boots": [1, 2]}]
RECORDS += [{"type": "end", "name": "ä \n"}]


class BrokenDisk(SystemDisk):
    """Fails with `code` at the n-th call of a method, or takes only some bytes at a time."""

    def __init__(self, method: str = "", at: int = 0, code: int = errno.ENOSPC, bite: int = 10**6) -> None:
        self.calls = {"reserve": 0, "write": 0, "sync": 0}
        self.method, self.at, self.code, self.bite = method, at, code, bite

    def _count(self, method: str) -> None:
        self.calls[method] += 1
        if method == self.method and self.calls[method] >= self.at:
            raise OSError(self.code, os.strerror(self.code))

    def reserve(self, descriptor: int, size: int) -> None:
        self._count("reserve")
        super().reserve(descriptor, size)

    def write(self, descriptor: int, data: bytes, offset: int) -> int:
        self._count("write")
        return super().write(descriptor, data[: self.bite], offset)

    def sync(self, descriptor: int) -> None:
        self._count("sync")
        super().sync(descriptor)


def write(folder: Path, disk: SystemDisk | None = None) -> Path:
    journal = Journal(folder, disk)
    for record in RECORDS:
        journal.append(record)
    journal.close()
    journal.close()
    return journal.path


def test_what_was_written_is_read(tmp_path: Path) -> None:
    path = write(tmp_path)
    assert read_journal(path) == RECORDS
    first = path.read_bytes().split(b"\n")[0]
    assert first[:15] == b"%06d 00000000" % (len(first) - 25)


def test_a_disk_that_takes_little_at_a_time_gets_it_all(tmp_path: Path) -> None:
    assert read_journal(write(tmp_path, BrokenDisk(bite=7))) == RECORDS


def test_a_journal_cut_at_any_byte_gives_all_whole_records(tmp_path: Path) -> None:
    path = write(tmp_path)
    whole = path.read_bytes()
    ends = [index + 1 for index, byte in enumerate(whole) if byte == 10]
    assert len(ends) == len(RECORDS)
    cut = tmp_path / "cut"
    for size in range(len(whole) + 1):
        count = sum(end <= size for end in ends)
        for tail in (b"", bytes(40)):
            cut.write_bytes(whole[:size] + tail)
            assert read_journal(cut) == RECORDS[:count]


def test_damage_before_the_end_is_refused_and_at_the_end_cut(tmp_path: Path) -> None:
    path = write(tmp_path)
    whole = path.read_bytes()
    last = whole.rindex(b"\n", 0, -1) + 1
    broken = tmp_path / "broken"
    for position in range(len(whole)):
        broken.write_bytes(whole[:position] + bytes([whole[position] ^ 4]) + whole[position + 1 :])
        if position < last:
            with pytest.raises(InvalidInput, match="damaged"):
                read_journal(broken)
        else:
            assert read_journal(broken) == RECORDS[:-1]


def test_a_missing_record_is_damage(tmp_path: Path) -> None:
    path = tmp_path / "gap"
    path.write_bytes(b"".join(encode_record(number, {"n": number}) for number in (0, 1, 3)))
    with pytest.raises(InvalidInput, match="record 3 cannot be read"):
        read_journal(path)


def test_garbage_is_no_journal(tmp_path: Path) -> None:
    random = Random(3)
    path = tmp_path / "garbage"
    for _ in range(200):
        path.write_bytes(random.randbytes(random.randrange(300)))
        assert read_journal(path) == []
    path.write_bytes(encode_record(0, {})[:-3] + b"[]\n")
    assert read_journal(path) == []


def test_a_record_is_an_object_even_with_a_good_checksum(tmp_path: Path) -> None:
    path = tmp_path / "list"
    path.write_bytes(encode_record(0, [1]))  # type: ignore[arg-type]
    assert read_journal(path) == []


def test_a_missing_journal_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="there is no such file"):
        read_journal(tmp_path / "nowhere")


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO])
@pytest.mark.parametrize("method", ["write", "sync"])
@pytest.mark.parametrize("at", range(1, 13))
def test_a_failing_disk_is_reported_and_nothing_is_added_after_it(
    tmp_path: Path, method: str, at: int, code: int
) -> None:
    if (method, at) == ("sync", 1):
        with pytest.raises(LinkError, match=os.strerror(code)):
            Journal(tmp_path, BrokenDisk(method, at, code))
        return
    disk = BrokenDisk(method, at, code)
    journal = Journal(tmp_path, disk)
    count = at - (1 if method == "write" else 2)
    for record in RECORDS[:count]:
        journal.append(record)
    with pytest.raises(LinkError, match=os.strerror(code)) as caught:
        journal.append(RECORDS[count])
    assert "CURVELINE_RUNS" in caught.value.hint
    disk.method = ""
    with pytest.raises(LinkError, match="cannot write"):
        journal.append({"type": "late"})
    journal.close()
    assert read_journal(journal.path) == RECORDS[:count]


def test_space_is_reserved_and_given_back(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    journal.reserve(100_000)
    assert journal.path.stat().st_size == 100_000
    journal.append(RECORDS[0])
    assert read_journal(journal.path) == RECORDS[:1]
    journal.close()
    assert journal.path.stat().st_size < 200
    (tmp_path / "full").mkdir()
    full = Journal(tmp_path / "full", BrokenDisk("reserve", 1))
    with pytest.raises(LinkError, match="No space left"):
        full.reserve(100_000)
    full.close()


def test_file_systems_without_reservations_are_used_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(descriptor: int, offset: int, size: int) -> None:
        raise OSError(errno.EOPNOTSUPP, "not supported")

    monkeypatch.setattr(journal_module.os, "posix_fallocate", refuse)
    journal = Journal(tmp_path)
    journal.reserve(1000)
    journal.append({"type": "end"})
    journal.close()
    assert read_journal(journal.path) == [{"type": "end"}]


def test_a_disk_that_takes_nothing_or_has_no_room_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    journal = Journal(tmp_path, BrokenDisk(bite=0))
    with pytest.raises(LinkError, match="took nothing"):
        journal.append({})

    def full(descriptor: int, offset: int, size: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(journal_module.os, "posix_fallocate", full)
    with pytest.raises(LinkError, match="No space left"):
        journal.reserve(1000)
    journal.close()


def test_an_interrupted_record_is_overwritten_by_the_next(tmp_path: Path) -> None:
    class Interrupted(SystemDisk):
        armed = True

        def sync(self, descriptor: int) -> None:
            if self.armed and os.fstat(descriptor).st_size:
                self.armed = False
                raise KeyboardInterrupt

    journal = Journal(tmp_path, Interrupted())
    with pytest.raises(KeyboardInterrupt):
        journal.append({"type": "a much longer record than the one that follows it"})
    journal.append({"type": "halt"})
    journal.append({"type": "end"})
    journal.close()
    assert read_journal(journal.path) == [{"type": "halt"}, {"type": "end"}]


def test_a_folder_holds_one_run(tmp_path: Path) -> None:
    write(tmp_path)
    with pytest.raises(InvalidInput, match="another run"):
        Journal(tmp_path)
    with pytest.raises(LinkError, match="cannot write"):
        Journal(tmp_path / "nowhere")


def test_a_record_beyond_the_format_is_refused() -> None:
    with pytest.raises(InvalidInput, match="too long"):
        encode_record(0, {"x": "y" * 10**6})


def test_the_runs_folder_follows_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CURVELINE_RUNS", "/chosen")
    assert runs_folder() == Path("/chosen")
    monkeypatch.delenv("CURVELINE_RUNS")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert runs_folder() == tmp_path / "curveline"
    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert runs_folder() == tmp_path / ".local" / "state" / "curveline"


def test_runs_get_folders_of_their_own(tmp_path: Path) -> None:
    runs = [new_run(tmp_path / "deep", "level up/../peak ä") for _ in range(5)]
    assert len(set(runs)) == 5
    assert all(run.is_dir() and run.parent == tmp_path / "deep" for run in runs)
    assert "level-up-..-peak" in runs[0].name
    assert new_run(tmp_path, "///").name.endswith("-run")
    (tmp_path / "file").write_text("")
    with pytest.raises(LinkError, match="cannot write"):
        new_run(tmp_path / "file", "x")
