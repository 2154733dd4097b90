"""The key file: made once, private, read as hostile input, and never shown."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from random import Random

import pytest

from curveline.errors import InvalidInput
from curveline.radio.protocol.keys import ZERO_MASTER, derive
from curveline.radio.site.key_file import SiteFile, adopt, default_path, hardware_site, lenient, new_site, read_site

from .bench import drive_table

MASTER = bytes(range(1, 17))
CHIPS = {"C1C1C1C101": 0x11223344, "C1C1C1C102": 0xA0B0C0D0}


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CURVELINE_KEYS", str(tmp_path / "keys" / "site.json"))
    return default_path()


def put(path: Path, text: str | bytes, mode: int = 0o600) -> None:
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    path.chmod(mode)


def good(**changes: object) -> str:
    nodes = {address: f"{chip:08x}" for address, chip in CHIPS.items()}
    checksum = "924dbc1f4627b870"
    return json.dumps({"curveline_site": 2, "master": MASTER.hex(), "nodes": nodes, "checksum": checksum, **changes})


def old(**changes: object) -> str:
    """A file of an older release."""
    document = json.loads(good(**{"curveline_site": 1, **changes}))
    del document["checksum"]
    return json.dumps(document)


def test_a_new_file_has_a_fresh_key_for_its_owner_only(path: Path, tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        made = new_site(path)
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    assert read_site(path) == made
    assert made.chips == {}
    assert len({made.master, new_site(tmp_path / "other.json").master, ZERO_MASTER}) == 3


def test_a_file_that_is_there_is_not_overwritten(path: Path) -> None:
    new_site(path)
    content = path.read_bytes()
    with pytest.raises(InvalidInput, match="exists already"):
        new_site(path)
    assert path.read_bytes() == content
    link = path.with_name("link.json")
    link.symlink_to(path.with_name("nowhere.json"))
    with pytest.raises(InvalidInput, match="exists already"):
        new_site(link)


def test_a_file_that_cannot_be_made_leaves_nothing(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InvalidInput, match="No space left"):
        new_site(path)
    assert list(path.parent.iterdir()) == []


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o602, 0o610])
def test_a_file_that_others_can_reach_is_refused_with_the_remedy(path: Path, mode: int) -> None:
    put(path, good(), mode)
    with pytest.raises(InvalidInput, match="by others") as caught:
        read_site(path)
    assert f"chmod 600 {path}" in caught.value.hint


def test_without_a_file_hardware_refuses_with_the_hint(path: Path) -> None:
    with pytest.raises(InvalidInput, match="no key file") as caught:
        hardware_site(drive_table())
    assert "curveline keys new" in caught.value.hint
    with lenient(without_file=True):
        site = hardware_site(drive_table())
    assert (site.master, site.chips) == (ZERO_MASTER, (0, 0))
    with lenient(), pytest.raises(InvalidInput, match="no key file"):
        hardware_site(drive_table())
    with pytest.raises(InvalidInput, match="no key file"):
        hardware_site(drive_table())


def test_a_node_that_nobody_adopted_is_refused_with_the_hint(path: Path) -> None:
    put(path, good())
    assert hardware_site(drive_table()).chips == tuple(CHIPS.values())
    with pytest.raises(InvalidInput, match="C1C1C1C103 of display 'test'") as caught:
        hardware_site(drive_table(3))
    assert "curveline keys adopt" in caught.value.hint
    with lenient():
        site = hardware_site(drive_table(3))
    assert (site.master, site.chips) == (MASTER, (*CHIPS.values(), 0))


def test_adopting_adds_and_moves(path: Path) -> None:
    site = new_site(path)
    site = adopt(site, {"c1c1c1c101": 7, "C1C1C1C102": 8})
    site = adopt(site, {"C1C1C1C103": 7})
    assert site.chips == {"C1C1C1C102": 8, "C1C1C1C103": 7}
    assert read_site(path) == site
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert [each.name for each in path.parent.iterdir()] == ["site.json"]


def test_what_others_record_meanwhile_stays(path: Path) -> None:
    """A question stands for as long as nobody answers it, and another terminal records others."""
    site = new_site(path)
    adopt(site, {"C1C1C1C101": 7})
    assert adopt(site, {"C1C1C1C102": 8}).chips == {"C1C1C1C101": 7, "C1C1C1C102": 8}
    assert read_site(path).chips == {"C1C1C1C101": 7, "C1C1C1C102": 8}


def test_a_key_file_that_was_exchanged_meanwhile_is_not_written_over(path: Path) -> None:
    site = new_site(path)
    path.rename(path.with_name("old.json"))
    with pytest.raises(InvalidInput, match="there is no key file"):
        adopt(site, {"C1C1C1C101": 7})
    other = new_site(path)
    with pytest.raises(InvalidInput, match="has been exchanged meanwhile"):
        adopt(site, {"C1C1C1C101": 7})
    assert read_site(path) == other


def test_an_adoption_that_fails_leaves_the_old_file(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    site = new_site(path)

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InvalidInput, match="No space left"):
        adopt(site, {"C1C1C1C101": 7})
    assert read_site(path) == site
    assert [each.name for each in path.parent.iterdir()] == ["site.json"]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "not JSON, from line 1"),
        (good()[:-5], "not JSON"),
        (good() + MASTER.hex(), "not JSON"),
        ("[" * 100_000, "nested without end"),
        (b"\xff" + MASTER, "not text"),
        ("[]", "curveline_site is not 2"),
        (good(curveline_site=3), "curveline_site is not 2"),
        (good(curveline_site=True), "curveline_site is not 2"),
        (good(curveline_site=1), "unknown entries"),
        (good(more=1), "unknown entries"),
        (old(curveline_site=2), "missing or unknown entries"),
        (old(more=1), "unknown entries"),
        (good(master=MASTER[::-1].hex()), "its checksum does not fit"),
        (good(nodes={}), "its checksum does not fit"),
        (good(checksum=None), "its checksum does not fit"),
        (good(checksum="924DBC1F4627B870"), "its checksum does not fit"),
        (good(master=None), "32 hexadecimal digits"),
        (good(master=MASTER.hex() + "0"), "32 hexadecimal digits"),
        (good(master=MASTER.hex() + "\n"), "32 hexadecimal digits"),
        (good(master="0" * 32), "nothing but zeros"),
        (good(nodes=[]), "no table"),
        (good(nodes={"C1C1": "00000001"}), "ten hexadecimal digits"),
        (good(nodes={MASTER.hex(): "00000001"}), "ten hexadecimal digits"),
        (good(nodes={"C1C1C1C101": 1}), "eight hexadecimal digits"),
        (good(nodes={"C1C1C1C101": "00000001", "C1C1C1C102": "00000001"}), "the same chip id"),
        (good().replace("{", '{"master": "' + MASTER.hex() + '",', 1), "says something twice"),
        ("1" * 5000, "digits"),
        (" " * 1_000_001, "too large"),
    ],
)
def test_a_damaged_file_is_refused_without_showing_it(path: Path, content: str | bytes, says: str) -> None:
    put(path, content)
    with pytest.raises(InvalidInput, match=says) as caught:
        read_site(path)
    shown = caught.value.message + caught.value.hint + repr(caught.value)
    assert str(path) in shown
    assert MASTER.hex() not in shown
    assert str(MASTER) not in shown
    assert caught.value.__cause__ is None


def test_a_file_of_an_older_release_is_read_and_written_anew_by_an_adoption(path: Path) -> None:
    put(path, old())
    site = read_site(path)
    assert (site.master, site.chips, site.has_checksum) == (MASTER, CHIPS, False)
    assert "older release" in site.remark
    assert "curveline keys adopt" in site.remark
    assert hardware_site(drive_table()).chips == tuple(CHIPS.values())
    known = adopt(site, {"C1C1C1C102": CHIPS["C1C1C1C102"]})
    assert read_site(path) == known == SiteFile(path, MASTER, CHIPS)
    assert known.remark == ""
    assert json.loads(path.read_text()) == json.loads(good())


def damaged(text: str, random: Random) -> str:
    """A text as a bad disk, an editor or a merge leaves it."""
    here, there = sorted(random.sample(range(len(text)), 2))
    kind = random.randrange(6)
    if kind == 0:
        return text[:here] + chr(ord(text[here]) ^ 1 << random.randrange(7)) + text[here + 1 :]
    if kind == 1:
        return text[:here] + random.choice("0123456789abcdefABCDEF") + text[here + 1 :]
    if kind == 2:
        return text[:here] + text[there] + text[here + 1 : there] + text[here] + text[there + 1 :]
    if kind == 3:
        return text[:here] + text[here + random.randrange(1, 30) :]
    if kind == 4:
        return text[:here] + text[there : there + random.randrange(1, 30)] + text[here:]
    lines = text.split("\n")
    lines[random.randrange(len(lines))] = random.choice(lines)
    return "\n".join(lines)


def test_no_damaged_file_gives_another_key_or_another_device(path: Path) -> None:
    put(path, good())
    site = adopt(read_site(path), {"C1C1C1C103": 3})
    text, same = path.read_text(), 0
    for number in range(3000):
        put(path, damaged(text, Random(number)))
        try:
            assert read_site(path) == site, number
            same += 1
        except InvalidInput:
            continue
    # White space, and digits that took their own place.
    assert 0 < same < 300


def test_a_checksum_tells_neither_the_key_nor_one_that_is_derived_from_it(path: Path) -> None:
    put(path, good())
    site = read_site(path).site(drive_table())
    text = path.read_text().replace(MASTER.hex(), "")
    for key in (site.stop_key, site.node_key(1), site.node_key(2), derive(MASTER, b"fingerprint")):
        assert not any(key.hex()[place : place + 8] in text for place in range(25))


def test_what_is_no_file_is_refused(path: Path, tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe, 0o600)
    for odd in (tmp_path, pipe):
        with pytest.raises(InvalidInput, match="no regular file"):
            read_site(odd)
    with pytest.raises(InvalidInput, match="cannot be read"):
        read_site(Path("a\0b"))


def test_where_the_file_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("CURVELINE_KEYS", "XDG_CONFIG_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert default_path() == tmp_path / ".config" / "curveline" / "site.json"
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "xdg"))
    assert default_path() == tmp_path / "xdg" / "curveline" / "site.json"
    monkeypatch.setenv("CURVELINE_KEYS", "elsewhere")
    assert default_path() == Path("elsewhere")


def test_neither_repr_nor_fingerprint_tells_the_key(path: Path) -> None:
    site = SiteFile(path, MASTER, CHIPS)
    for shown in (repr(site), str(site), repr(site.site(drive_table())), site.fingerprint):
        assert MASTER.hex() not in shown
        assert str(MASTER) not in shown
    assert site.fingerprint != SiteFile(path, MASTER[::-1]).fingerprint
    assert len(site.fingerprint) == 8
