"""Journals: cut anywhere, damaged anywhere, and disks that refuse."""

from __future__ import annotations

import errno
import fcntl
import os
from collections.abc import Callable
from pathlib import Path
from random import Random
from zlib import crc32

import pytest

from curveline.errors import InvalidInput, LinkError
from curveline.radio.host import journal as journal_module
from curveline.radio.host.journal import (
    Journal,
    ReopenedJournal,
    SystemDisk,
    encode_record,
    find_run,
    is_open,
    new_run,
    read_journal,
    runs_folder,
)
from curveline.system import portable

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


def test_file_systems_without_reservations_get_zeros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(descriptor: int, offset: int, size: int) -> None:
        raise OSError(errno.EOPNOTSUPP, "not supported")

    monkeypatch.setattr(os, "posix_fallocate", refuse)
    journal = Journal(tmp_path)
    journal.reserve(100_000)
    assert journal.path.read_bytes() == bytes(100_000)
    journal.append({"type": "end"})
    journal.close()
    assert read_journal(journal.path) == [{"type": "end"}]


def test_a_disk_that_takes_nothing_or_has_no_room_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    journal = Journal(tmp_path, BrokenDisk(bite=0))
    with pytest.raises(LinkError, match="took nothing"):
        journal.append({})

    def full(descriptor: int, offset: int, size: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
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


# Opened again


def half(folder: Path) -> Path:
    """A journal that was broken off in the midst of its fifth record, with space reserved behind it."""
    path = write(folder)
    whole = path.read_bytes()
    end = len(b"".join(whole.splitlines(keepends=True)[:4]))
    path.write_bytes(whole[: end + 30] + bytes(5000))
    return path


def test_a_broken_off_journal_is_continued_where_it_was_whole(tmp_path: Path) -> None:
    path = half(tmp_path)
    journal = ReopenedJournal(tmp_path)
    assert journal.records == RECORDS[:4]
    assert path.stat().st_size == len(b"".join(path.read_bytes().splitlines(keepends=True)[:4]))
    size = path.stat().st_size
    journal.reserve(1000)
    assert path.stat().st_size == size + 1000
    for record in RECORDS[4:]:
        journal.append(record)
    journal.close()
    assert read_journal(path) == RECORDS
    for number, line in enumerate(path.read_bytes().splitlines()):
        assert int(line[7:15]) == number


@pytest.mark.parametrize("opener", [Journal, ReopenedJournal])
def test_one_process_at_a_time_has_a_run(tmp_path: Path, opener: type[Journal]) -> None:
    (tmp_path / "run").mkdir()
    if opener is ReopenedJournal:
        half(tmp_path / "run")
    first = opener(tmp_path / "run")
    with pytest.raises(LinkError, match="another process is sending the run run"):
        ReopenedJournal(tmp_path / "run")
    first.close()
    ReopenedJournal(tmp_path / "run").close()


def test_a_journal_that_was_locked_between_its_creation_and_its_lock_is_left_to_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(portable, "lock", lambda descriptor: False)
    with pytest.raises(LinkError, match="another process"):
        Journal(tmp_path)


def test_a_file_system_that_cannot_lock_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    half(tmp_path)

    def no_locks(descriptor: int, operation: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    with pytest.raises(LinkError, match="No locks available"):
        ReopenedJournal(tmp_path)


def test_a_damaged_journal_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = write(tmp_path)
    whole = path.read_bytes()
    path.write_bytes(whole[:40] + b"?" + whole[41:])
    with pytest.raises(InvalidInput, match="damaged"):
        ReopenedJournal(tmp_path)
    assert path.read_bytes() == whole[:40] + b"?" + whole[41:]


def head(length: int, number: int) -> bytes:
    """The head of a record that somebody has made up."""
    return b"%06d %08d %08x " % (length, number, 0)


def long_heads(size: int) -> bytes:
    """One head after the other, each of a record as long as can be, none of which ends where it says."""
    return b"".join(head(999_999, number) for number in range(1, size // 25))


def fitting_heads(size: int) -> bytes:
    """One head after the other, each of a record that reaches to the one end of a line."""
    return b"".join(head(size - 25 * number, number) for number in range(1, size // 25)) + b"x" * 25 + b"\n"


class Watched(bytes):
    """The content of a file that counts what is copied out of it."""

    copied = 0

    def __getitem__(self, key: slice) -> bytes:  # type: ignore[override]
        part = super().__getitem__(key)
        Watched.copied += len(part)
        return part


@pytest.mark.parametrize("forged", [long_heads, fitting_heads])
def test_forged_heads_are_looked_through_in_one_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, forged: Callable[[int], bytes]
) -> None:
    """Bytes that were copied and checksummed are counted: no byte is looked at more than a few times."""
    data = Watched(encode_record(0, RECORDS[0]) + forged(500_000))
    summed: list[int] = []
    monkeypatch.setattr(journal_module, "read_file", lambda path, limit: data)
    monkeypatch.setattr(journal_module, "crc32", lambda part: summed.append(len(part)) or crc32(part))
    monkeypatch.setattr(Watched, "copied", 0)
    if forged is long_heads:
        assert read_journal(tmp_path) == RECORDS[:1]
    else:
        with pytest.raises(InvalidInput, match="damaged"):
            read_journal(tmp_path)
    assert sum(summed) <= 2 * len(data)
    assert Watched.copied <= 3 * len(data)


def test_a_record_behind_forged_heads_is_still_found(tmp_path: Path) -> None:
    path = tmp_path / "journal"
    for forged in (long_heads(1000), b"".join(head(0, number) + b"\n" for number in range(1, 40)), head(0, 1) * 40):
        path.write_bytes(encode_record(0, RECORDS[0]) + forged)
        assert read_journal(path) == RECORDS[:1]
        path.write_bytes(encode_record(0, RECORDS[0]) + forged + encode_record(1, RECORDS[1]))
        with pytest.raises(InvalidInput, match="record 2 cannot be read, but later ones can"):
            read_journal(path)


def test_what_cannot_be_opened_again_is_said(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="holds no record of a run"):
        ReopenedJournal(tmp_path)
    (tmp_path / "journal").mkdir()
    with pytest.raises(LinkError, match="cannot write"):
        ReopenedJournal(tmp_path)
    (tmp_path / "journal").rmdir()
    os.mkfifo(tmp_path / "journal")
    with pytest.raises(LinkError, match="cannot write"):
        ReopenedJournal(tmp_path)
    reader = os.open(tmp_path / "journal", os.O_RDONLY | os.O_NONBLOCK)
    with pytest.raises(InvalidInput, match="a device or a pipe"):
        ReopenedJournal(tmp_path)
    os.close(reader)


def test_a_checksum_makes_no_record_out_of_what_is_none(tmp_path: Path) -> None:
    path = tmp_path / "strange"
    for body in (b"{", b"\xff", b"[" * 100_000, b"9" * 5000):
        number = b"%08d" % 0
        path.write_bytes(b"%06d %s %08x %s\n" % (len(body), number, crc32(number + body), body))
        assert read_journal(path) == []


def a_run(folder: Path, name: str, records: list[dict[str, object]]) -> Path:
    run = folder / name
    run.mkdir(parents=True)
    journal = Journal(run)
    for record in records:
        journal.append(record)
    journal.close()
    return run


def test_a_run_is_found_by_name_and_by_path(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    old = a_run(runs, "b-old", [{"type": "start"}])
    refused = a_run(runs, "c-refused", [{"type": "halt"}])
    (runs / "no-run").mkdir()
    assert find_run(runs, "b-old") == old
    assert find_run(runs, str(refused)) == refused
    for name in ("nothing", "no-run", "runs/b-old", "..", "last"):
        with pytest.raises(InvalidInput, match="there is no run"):
            find_run(runs, name)


def test_a_run_in_the_present_folder_needs_no_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = a_run(tmp_path, "here", [{"type": "start"}])
    monkeypatch.chdir(tmp_path)
    assert find_run(tmp_path / "runs", "here").resolve() == run
    assert find_run(tmp_path / "runs", "./here").resolve() == run


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


def test_a_run_is_open_as_long_as_somebody_sends_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = new_run(tmp_path, "test")
    assert not is_open(run)
    journal = Journal(run)
    assert is_open(run)
    journal.close()
    assert not is_open(run)

    def refuse(descriptor: int) -> bool:
        raise OSError("no locks on this disk")

    monkeypatch.setattr("curveline.system.portable.lock", refuse)
    assert not is_open(run)
