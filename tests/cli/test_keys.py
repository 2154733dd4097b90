"""`curveline keys`: made once, loaded into nodes, adopted, and never shown."""

from __future__ import annotations

import json
import re
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from curveline.drive_settings import drive_settings
from curveline.radio.protocol.node_settings import node_settings
from curveline.radio.site import key_file
from curveline.radio.site.key_file import SiteFile, read_site
from curveline.shapes.files import builtin_text, read_display
from hexfile import bytes_of

from .conftest import Run

HEX = ":0800000000180020C1000000FF\n:00000001FF\n"
COMMANDS = ("new", "node", "adopt", "show")


@pytest.fixture
def keys(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A key file with no nodes."""
    path = tmp_path / "config" / "site.json"
    monkeypatch.setenv("CURVELINE_KEYS", str(path))
    assert run("keys", "new").code == 0
    return path


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(run: Run, command: str) -> None:
    code, out, err = run("keys", command, "--help")
    assert (code, err) == (0, "")
    assert "Exit codes" in out
    assert all(len(line) <= 80 for line in out.splitlines())
    assert command in run("keys", "--help").out


def test_keys_are_made_once(run: Run, keys: Path, tmp_path: Path) -> None:
    content = keys.read_bytes()
    assert stat.S_IMODE(keys.stat().st_mode) == 0o600
    code, out, err = run("keys", "new")
    assert (code, out) == (2, "")
    assert "exists already" in err
    assert keys.read_bytes() == content
    assert run("keys", "new", "--file", tmp_path / "other.json").code == 0
    assert read_site(tmp_path / "other.json").master != read_site(keys).master


def test_what_is_known_is_shown_and_the_key_is_not(run: Run, keys: Path) -> None:
    site = read_site(keys)
    assert run("keys", "show").out == f"{keys}: master key {site.fingerprint} (a fingerprint, not the key)\nno nodes\n"
    assert run("keys", "adopt", "--radio", "mock:keys", "--yes").code == 0
    chips = {address: f"{chip:08x}" for address, chip in read_site(keys).chips.items()}
    assert len(chips) == 2
    out = run("keys", "show").out
    assert all(text in out for pair in chips.items() for text in pair)
    document = json.loads(run("keys", "show", "--json").out)
    assert document["chips"] == chips
    assert document["fingerprint"] == site.fingerprint
    keys.chmod(0o644)
    code, _, err = run("keys", "show")
    assert code == 2
    assert f"chmod 600 {keys}" in err


def test_one_board_is_adopted_and_tried_out_while_the_others_are_off(run: Run, keys: Path) -> None:
    radio = ("--radio", "mock:keys,away=2")
    code, out, err = run("node", "info", 2, *radio)
    assert (code, out) == (2, "")
    assert "does not say which device listens on C1C1C1C102 of display 'single'" in err
    assert run("keys", "adopt", 1, *radio, "--yes").code == 0
    assert set(read_site(keys).chips) == {"C1C1C1C101"}
    assert run("node", "info", 1, *radio).code == 0
    assert run("node", "check", 1, "bias", *radio, "--yes").code == 0
    assert run("status", *radio).code == 2, "it is asked of all nodes, one of which nobody knows"
    assert run("keys", "adopt", 2, "--radio", "mock:keys", "--yes").code == 0
    assert run("status", "--radio", "mock:keys").code == 0


def test_a_node_that_is_to_be_adopted_and_does_not_answer_is_looked_for(run: Run, keys: Path) -> None:
    code, out, err = run("keys", "adopt", 2, "--radio", "mock:keys,channel=2", "--yes")
    assert (code, out) == (3, "")
    assert "node 2 does not answer on channel 76, which the display file names, but on 23" in err
    code, _, err = run("keys", "adopt", 2, "--radio", "mock:keys,away=2", "--yes")
    assert code == 3
    assert "node 2: no answer from C1C1C1C102 on any channel" in err
    code, _, err = run("keys", "adopt", "--radio", "mock:keys,away=1", "--yes")
    assert code == 3
    assert "looking on the others" not in err, "where nobody answers it is not one node's channel"
    code, _, err = run("keys", "adopt", 3, "--radio", "mock:keys", "--yes")
    assert code == 2
    assert "there is no node 3: display 'single' has nodes 1 to 2" in err
    assert not read_site(keys).chips


def test_a_key_file_of_an_older_release_is_used_and_adoption_writes_it_anew(
    run: Run, keys: Path, tmp_path: Path
) -> None:
    (tmp_path / "node.hex").write_text(HEX)
    document = json.loads(keys.read_text())
    del document["checksum"]
    keys.write_text(json.dumps({**document, "curveline_site": 1}))
    image = ("keys", "node", 1, "--hex", tmp_path / "node.hex", "-o", tmp_path / "node1.hex")
    for command in (("keys", "show"), image):
        result = run(*command)
        assert result.code == 0
        assert f"{keys} was written by an older release and has no checksum" in " ".join(result.err.split())
    assert run("keys", "adopt", "--radio", "mock:keys", "--yes").code == 0
    assert json.loads(keys.read_text())["master"] == document["master"]
    assert "older release" not in run("keys", "show").err


def test_without_keys_the_hint_says_how_to_make_them(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CURVELINE_KEYS", str(tmp_path / "none.json"))
    for command in (
        ("keys", "show"),
        ("keys", "adopt", "--radio", "mock:keys", "--yes"),
        ("status", "--radio", "mock:keys"),
        ("stop", "--radio", "mock:keys"),
    ):
        code, _, err = run(*command)
        assert code == 2, command
        assert "curveline keys new" in err
    assert run("status", "--radio", "mock").code == 0
    assert run("status", "--radio", "mock:keys", "--scan").code == 0


@pytest.mark.parametrize("radio", ["mock", "mock:seed=3"])
@pytest.mark.parametrize("has_keys", [False, True])
def test_a_mock_display_is_not_adopted_but_trying_it_works_as_told(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, radio: str, has_keys: bool
) -> None:
    if has_keys:
        assert run("keys", "new").code == 0
    code, out, err = run("keys", "adopt", "--radio", radio, "--yes")
    assert (code, out) == (2, "")
    assert "there is nothing to adopt" in err
    monkeypatch.chdir(tmp_path)
    lines = re.findall(r"`CURVELINE_KEYS=(\S+) curveline ([^`]*)`", err)
    assert len(lines) == 2
    for keys, line in lines:
        monkeypatch.setenv("CURVELINE_KEYS", keys)
        assert run(*line.split(), *(["--yes"] if "adopt" in line else [])).code == 0


def test_what_is_no_program_of_a_node_is_called_by_its_name(run: Run, keys: Path, tmp_path: Path) -> None:
    for name, text, kind in (
        ("a.toml", builtin_text("single"), "a display file"),
        ("b.json", keys.read_text(), "the key file of a site"),
    ):
        (tmp_path / name).write_text(text)
        code, _, err = run("keys", "node", 1, "--hex", tmp_path / name, "-o", tmp_path / "out.hex")
        assert code == 2
        assert f"this is {kind}, not a program for a node" in err
        assert json.loads(keys.read_text())["master"] not in err
    assert not (tmp_path / "out.hex").exists()


def test_encoders_that_are_too_fast_for_a_node_pass_neither_a_check_nor_into_an_image(
    run: Run, keys: Path, tmp_path: Path
) -> None:
    fast = tmp_path / "fast.toml"
    fast.write_text(builtin_text("single").replace("counts_per_turn = 8344", "counts_per_turn = 400000"))
    line = 1 + fast.read_text().split("counts_per_turn =")[0].count("\n")
    (tmp_path / "node.hex").write_text(HEX)
    target = tmp_path / "node1.hex"
    image = ("keys", "node", 1, "--hex", tmp_path / "node.hex", "-o", target, "--display", fast)
    for command in (("display", "check", fast), image):
        code, out, err = run(*command)
        assert (code, out) == (2, "")
        assert f"{fast}:{line}:19: error[too-many-edges]" in err
        assert "468302 edges/s together, and a node can count 115107" in err
    assert not target.exists()


def test_nodes_are_adopted_and_from_then_on_believed(run: Run, keys: Path, plan_file: Path) -> None:
    code, _, err = run("status", "--radio", "mock:keys")
    assert code == 2
    assert "curveline keys adopt" in err
    code, out, err = run("keys", "adopt", "--radio", "mock:keys", "--yes")
    assert code == 0
    assert out.count("new") == 2
    assert f"recorded in {keys}" in err
    assert run("keys", "adopt", "--radio", "mock:keys", "--yes").out.count("as before") == 2
    assert run("send", plan_file, "--radio", "mock:keys", "--yes").code == 0
    assert "2  ready" in run("status", "--radio", "mock:keys").out
    assert run("status", "--radio", "mock:keys", "--scan").code == 0
    assert run("stop", "--radio", "mock:keys").code == 0


def test_another_device_is_noticed_and_its_adoption_says_so(run: Run, keys: Path, plan_file: Path) -> None:
    run("keys", "adopt", "--radio", "mock:keys", "--yes")
    before = read_site(keys).chips
    code, out, _ = run("status", "--radio", "mock:keys,chip=2", "--scan")
    assert code == 3
    assert f"instead of {before['C1C1C1C102']:08x}, which the site knows" in out
    out = run("keys", "adopt", "--radio", "mock:keys,chip=2", "--yes").out
    assert f"was {before['C1C1C1C102']:08x}" in out
    assert run("status", "--radio", "mock:keys,chip=2").code == 0
    assert run("status", "--radio", "mock:keys").code == 3


@pytest.mark.parametrize(
    ("settings", "code", "says"),
    [
        ("mock:keys,twin=1", 3, "2 devices answer"),
        ("mock:keys,version=1", 3, "speaks version 3"),
        ("mock:keys,loss=0.999", 3, "no answer from"),
        ("mock", 2, "mock:keys"),
    ],
)
def test_doubtful_nodes_are_not_adopted(run: Run, keys: Path, settings: str, code: int, says: str) -> None:
    content = keys.read_bytes()
    found = run("keys", "adopt", "--radio", settings, "--yes")
    assert found.code == code
    assert says in found.err
    assert keys.read_bytes() == content


def test_adopting_asks_first(run: Run, keys: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code, _, err = run("keys", "adopt", "--radio", "mock:keys")
    assert code == 2
    assert "--yes" in err
    for name in ("stdin", "stderr"):
        monkeypatch.setattr(getattr(sys, name), "isatty", lambda: True)
    monkeypatch.setattr(typer, "confirm", lambda text, err: False)
    content = keys.read_bytes()
    code, out, err = run("keys", "adopt", "--radio", "mock:keys")
    assert code == 1
    assert "C1C1C1C102" in out
    assert "nothing was recorded" in err

    def interrupt(text: str, err: bool) -> bool:
        raise typer.Abort

    monkeypatch.setattr(typer, "confirm", interrupt)
    assert run("keys", "adopt", "--radio", "mock:keys").code == 130
    assert keys.read_bytes() == content


def test_a_node_gets_an_image_of_its_own(run: Run, keys: Path, tmp_path: Path) -> None:
    (tmp_path / "node.hex").write_text(HEX)
    target = tmp_path / "two.hex"
    code, out, err = run("keys", "node", 2, "--hex", tmp_path / "node.hex", "-o", target, "--display", "single")
    assert code == 0
    assert "address C1C1C1C102" in out
    assert "teensy_loader_cli" in err
    assert stat.S_IMODE(target.stat().st_mode) == 0o600
    cells = bytes_of(target.read_text())
    sector = node_settings(read_site(keys).master, drive_settings(read_display("single")), 2).sector()
    assert bytes(cells[0xF400 + index] for index in range(len(sector))) == sector
    assert bytes(cells[0xF000 + index] for index in range(4)) == bytes(4), "nothing older is left there"
    content = target.read_bytes()
    code, _, err = run("keys", "node", 1, "--hex", tmp_path / "node.hex", "-o", target)
    assert code == 2
    assert "exists already" in err
    assert target.read_bytes() == content


def test_a_key_that_the_next_commit_would_take_along_is_pointed_out(
    run: Run, keys: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a git work tree until its .gitignore has the line that the note names; nowhere else, nor without git."""
    lab = tmp_path / "lab"
    lab.mkdir()
    (lab / "node.hex").write_text(HEX)

    def said(target: str) -> str:
        new = ("keys", "new", "--file") if target.endswith(".json") else ("keys", "node", 1, "--hex", "node.hex", "-o")
        Path(target).unlink(missing_ok=True)
        result = run(*new, target)
        assert result.code == 0
        return result.err

    monkeypatch.chdir(lab)
    for target, line in (("node1.hex", "*.hex"), ("site.json", "site.json")):
        assert "work tree" not in said(target)
        subprocess.run(["git", "init", "--quiet", "."], check=True)
        noted = said(target)
        assert f"warning: {target} holds the site's key, and the git work tree" in noted
        assert f"add a line {line} to its .gitignore" in noted
        with monkeypatch.context() as without_git:
            without_git.setenv("PATH", str(tmp_path))
            assert "work tree" not in said(target)
        (lab / ".gitignore").write_text(f"{line}\n")
        assert "work tree" not in said(target)
        shutil.rmtree(lab / ".git")
        (lab / ".gitignore").unlink()


def test_a_node_or_image_that_is_none_is_refused(run: Run, keys: Path, tmp_path: Path) -> None:
    good, bad, out = tmp_path / "node.hex", tmp_path / "bad.hex", tmp_path / "out.hex"
    good.write_text(HEX)
    bad.write_text(HEX.replace("C1", "C2"))
    for number, source, says in (
        (3, good, "no node 3"),
        (1, bad, "bad.hex:1:1: error[bad-image]"),
        (1, out, "no such"),
    ):
        code, _, err = run("keys", "node", number, "--hex", source, "-o", out)
        assert code == 2
        assert says in err
        assert not out.exists()
    code, _, err = run("keys", "node", 1, "--hex", good, "-o", tmp_path / "nowhere" / "out.hex")
    assert code == 2
    assert "cannot be written" in err


SECRET = bytes.fromhex("a1b2c3d4e5f60718293a4b5c6d7e8f90")


def test_the_key_is_in_no_output_and_in_no_file_but_its_own(
    run: Run, keys: Path, plan_file: Path, tmp_path: Path
) -> None:
    """Everything that commands say and leave behind, in a good run and in bad ones, searched in four spellings."""
    keys.unlink()
    key_file._create(keys, SiteFile(keys, SECRET))
    said = []
    for arguments in (
        ("keys", "adopt", "--radio", "mock:keys", "--yes"),
        ("keys", "show"),
        ("keys", "show", "--json"),
        ("keys", "new"),
        ("send", plan_file, "--radio", "mock:keys", "--yes", "--json"),
        ("send", plan_file, "--radio", "mock:keys", "--dry-run", "--json"),
        ("send", plan_file, "--radio", "mock:keys", "--yes"),
        ("send", plan_file, "--radio", "mock:fresh,keys,stall=1@step1", "--yes", "--json"),
        ("send", plan_file, "--radio", "mock:fresh,keys,gone@step1", "--yes"),
        ("send", plan_file, "--radio", "mock:fresh,keys,chip=1", "--yes"),
        ("status", "--radio", "mock:keys,fresh", "--json"),
        ("status", "--radio", "mock:keys", "--scan", "--json"),
        ("status", "--radio", "mock:keys", "--radio-test", "--json"),
        ("stop", "--radio", "mock:keys", "--json"),
    ):
        found = run(*arguments)
        assert "Traceback" not in found.err
        said.append(found.out + found.err)
    keys.write_text(keys.read_text() + "x")
    said.append(run("keys", "show").err)
    spellings = (SECRET, SECRET[::-1], SECRET.hex().encode(), SECRET.hex().upper().encode(), repr(SECRET).encode())
    left = [path for path in tmp_path.rglob("*") if path.is_file() and path != keys]
    assert len(left) > 5, "records of runs and the display's memory"
    for text in ["".join(said).encode(), *(path.read_bytes() for path in left)]:
        assert not any(spelling in text for spelling in spellings)
