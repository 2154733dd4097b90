"""README.md and the pages: what they name exists, what they show is printed, what is made of the source is whole."""

from __future__ import annotations

import enum
import importlib
import inspect
import re
import shlex
import tomllib
from collections.abc import Iterator
from pathlib import Path

import api_reference
import command_reference
import hooks
import printed
import pytest
from typer.testing import CliRunner

import curveline
import standby
from curveline.cli.app import app

ROOT = Path(__file__).parents[1]
PAGES = [*printed.PAGES, ROOT / "firmware" / "README.md", ROOT / "firmware" / "dongle" / "README.md"]
RUN = [page for page in printed.PAGES if page.name != "README.md" and any(each.is_run for each in printed.blocks(page))]
"""Pages with blocks that run; those of README.md have a test of their own."""

PATH = re.compile(r"(?<![\w/.-])(?:\.ci|curveline|docs|firmware|shapes|tests)/[\w./*-]*[\w*]")
MADE = ("firmware/build", "firmware/dongle/build")
"""Folders that are made when firmware is built."""
FILE = re.compile(r"`(\w+\.(?:py|c|h|ino|toml))`")
MODULE = re.compile(r"(?<![\w/.`-])`?((?:tests|curveline)(?:\.[A-Za-z_]\w*)+)")
INLINE = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"\]\(([^)\s]+)\)")
OPTION = re.compile(r"(?<!\S)--?[A-Za-z][\w-]*")
OTHERS = {
    "--durations", "--mcu", "--on", "--pdb", "--reload", "--scenes", "--seeds", "--strict", "--trace", "--write",
}  # fmt: skip
"""Options of other programs, and of the project's own that are no commands."""


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.fixture(params=PAGES, ids=name_of)
def page(request: pytest.FixtureRequest) -> Path:
    return request.param


def test_every_path_that_is_named_exists(page: Path) -> None:
    for path in PATH.findall(page.read_text()):
        assert path.startswith(MADE) or any(ROOT.glob(path)), path


def test_every_file_that_is_named_exists(page: Path) -> None:
    """A name without its folder is that of a file somewhere in the tree, one that the page saves, or a reader's own."""
    saved = {each.note.split()[1] for each in printed.blocks(page) if each.note.startswith("file")}
    known = {path.name for folder in ("curveline", "firmware", "tests", "docs", "shapes") for path in files(folder)}
    assert set(FILE.findall(page.read_text())) - saved - known - {"mine.toml", "lab.toml", "camera.toml"} == set()


def files(folder: str) -> Iterator[Path]:
    return (ROOT / folder).rglob("*.*")


def test_every_module_that_is_named_exists(page: Path) -> None:
    for name in MODULE.findall(page.read_text()):
        assert is_known(name), name


def is_known(name: str) -> bool:
    """True for a module of the tests, and for what can be imported from the package."""
    if name.startswith("tests."):
        path = ROOT / Path(*name.split("."))
        return path.with_suffix(".py").exists() or path.is_dir()
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:count]))
        except ModuleNotFoundError:
            continue
        for part in parts[count:]:
            if not hasattr(found, part):
                return False
            found = getattr(found, part)
        return True
    return False


def headings(page: Path) -> set[str]:
    """The anchors of a page."""
    titles = re.findall(r"^#+ (.*)$", hooks.expanded(page.read_text(), "page.md"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.replace("`", "")).strip().lower().replace(" ", "-") for title in titles}


def test_every_link_leads_somewhere(page: Path) -> None:
    for link in LINK.findall(page.read_text()):
        if not link.startswith("https://"):
            file, _, anchor = link.partition("#")
            target = (page.parent / file).resolve() if file else page
            assert target.exists(), link
            assert not anchor or anchor in headings(target), link


COMMANDS = dict(command_reference.commands())
OPTIONS = {name: command_reference.options(command) for name, command in COMMANDS.items()}


def uses(text: str) -> Iterator[tuple[str, list[str]]]:
    """Every use of a command in a text: its full name, and the options that follow."""
    for line in re.sub(r"\\\n>?", " ", text).splitlines():
        for part in re.split(r"\||&&|;|\$\(|#|`", line.removeprefix("$ ")):
            words = part.split()
            for count in (3, 2):
                name = " ".join(words[:count])
                if name in COMMANDS and name != "curveline":
                    yield name, OPTION.findall(" ".join(words[count:]))
                    break


def test_every_command_and_option_that_is_named_exists(page: Path) -> None:
    text = page.read_text()
    inline = INLINE.findall(text)
    groups = {name.split()[1] for name in COMMANDS if " " in name}
    short = [f"curveline {each}" for each in inline if each.split() and each.split()[0] in groups]
    for name, options in uses("\n".join([text, *inline, *short])):
        assert not set(options) - OPTIONS[name], name
    known = set().union(*OPTIONS.values()) | OTHERS
    assert {each for code in inline for each in OPTION.findall(code) if each.startswith("--")} <= known


@pytest.fixture
def _standby(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Commands and programs are on standby; the first one of README.md begins as it does for everybody."""
    monkeypatch.setattr(printed, "PYTHON", standby.python())
    monkeypatch.setattr(printed, "COMMANDS", standby.commands(tmp_path / "bin"))


@pytest.mark.usefixtures("_standby")
@pytest.mark.parametrize("page", RUN, ids=name_of)
def test_what_a_page_prints_is_what_is_printed(page: Path) -> None:
    for block, done in printed.reports(page):
        assert not (found := printed.differences(block, done)), "\n".join(found)


SLOW = [(page, each) for page in printed.PAGES for each in printed.blocks(page) if each.note == "slow"]


@pytest.mark.campaign
@pytest.mark.parametrize(("page", "block"), SLOW, ids=[name_of(page) for page, _ in SLOW])
def test_what_takes_a_minute_runs(page: Path, block: printed.Block, tmp_path: Path) -> None:
    done = printed.run(block, printed.clone(tmp_path / "clone"))
    assert not printed.differences(block, done)


def test_numbers_and_words_are_compared() -> None:
    """The comparison itself: it overlooks times, dates and rounding, and nothing else."""
    page = "$ curveline x\npeak 115.21 mm, 0.9 ms\n⣀⠤\nbegun 2026-01-02 03:04:05\n"
    block = printed.Block("console", page, "", (0, 0))

    def differs(text: str, code: int = 0) -> bool:
        return bool(printed.differences(block, printed.Printed(code, "", "", text)))

    assert not differs(page)
    assert not differs("$ curveline x\npeak  115.3 mm, 17 ms\n⠒\nbegun 2027-11-12 13:14:15\n")
    assert differs(page.replace("peak", "valley"))
    assert differs(page.replace("115.21", "135.21"))
    assert differs(page + "more\n")
    assert differs(page.replace("begun 2026-01-02 03:04:05\n", ""))
    assert differs(page, code=1)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_reference_has_what_help_says(name: str) -> None:
    said = CliRunner().invoke(app, [*name.split()[1:], "--help"]).stdout
    written = command_reference.markdown().split(f"# {name}\n")[1].split("\n#")[0]
    for option in re.findall(r"^  (?:-\w, )?(--[\w-]+)", said, re.MULTILINE):
        assert f"{option}" in written, option
    sentence = re.sub(r"\s+", " ", said.split("\n\n")[1]).strip()
    assert sentence in re.sub(r"\s+", " ", written)


def test_every_command_has_a_line_in_the_overview() -> None:
    overview = (ROOT / "docs" / "commands.md").read_text()
    for name in {name.split()[1] for name in COMMANDS if " " in name}:
        assert re.search(rf"^\| `{name}\b", overview, re.MULTILINE), name


def test_the_library_is_described_whole() -> None:
    page = hooks.expanded((ROOT / "docs" / "api.md").read_text(), "api.md")
    assert api_reference.public_names()
    for name in api_reference.public_names():
        described = page.split(f"## {name}\n")[1].split("\n## ")[0]
        assert len(described) > len(name) + 40, name
    assert "| `span` | `float` | [m] between neighbouring nodes |" in page
    assert "`curve(points: int) -> Array`" in page


def shown_classes() -> list[type]:
    """The classes on the page of the library, those that are offered by name and those that come out of them."""
    offered = [getattr(curveline, name) for name in api_reference.public_names()]
    kinds = [each for each in offered if isinstance(each, type)]
    return [*kinds, *(each for each in api_reference.classes(offered) if each not in kinds)]


@pytest.mark.parametrize("kind", shown_classes(), ids=lambda kind: kind.__name__)
def test_every_field_and_method_that_a_user_gets_is_explained(kind: type) -> None:
    """A field by the words beside it or in the docstring of its class, a method or property by its own docstring."""
    told = inspect.getdoc(kind) or ""
    if not issubclass(kind, enum.Enum):
        assert [name for name, _, words in api_reference.fields(kind) if not words and f"`{name}" not in told] == []
    own = {name: each for name, each in vars(kind).items() if isinstance(each, property) or inspect.isfunction(each)}
    assert [name for name, each in own.items() if name[0] != "_" and not inspect.getdoc(each)] == []


def test_results_of_the_library_are_described() -> None:
    names = {kind.__name__ for kind in shown_classes()}
    results = {"DisplayStatus", "DryRun", "Halting", "Loading", "Plan", "Run", "RunResult", "ScanResult", "Session"}
    assert results | {"ShapeReport", "SnapFall", "SweepReport", "Trials"} <= names
    assert not {"Journal", "Outlet", "Radio", "Stand"} & names


def test_every_class_in_the_glossary_exists() -> None:
    sources = [path.read_text() for path in (ROOT / "curveline").rglob("*.py")]
    known = set(re.findall(r"^(?:class|type) (\w+)", "\n".join(sources), re.MULTILINE))
    text = (ROOT / "docs" / "glossary.md").read_text()
    named = set(re.findall(r"`((?:[A-Z][a-z]+)+)`", text))
    assert len(named) > 20
    assert named <= known, named - known


ON_THE_AIR = ("radio-protocol.md", "security.md", "dongle-protocol.md", "firmware-update.md")
"""Pages on which a session is one host with one node under one key."""


def test_the_two_kinds_of_session_have_two_names() -> None:
    for page in (ROOT / "docs").rglob("*.md"):
        text = page.read_text()
        if page.name in ON_THE_AIR:
            bare = re.findall(r'(?i)(?<!radio )(?<!")\bsessions?\b(?! key)', text)
            assert not bare, page
        elif page.name != "glossary.md":
            assert "radio session" not in text, page
    glossary = (ROOT / "docs" / "glossary.md").read_text()
    assert [word.count("session") for word in re.findall(r"^\| ((?:radio )?session) \|", glossary, re.MULTILINE)] == [
        1,
        1,
    ]


def test_every_part_that_is_made_is_put_in() -> None:
    for page in (ROOT / "docs").rglob("*.md"):
        name = str(page.relative_to(ROOT / "docs"))
        assert "<!-- include" not in hooks.expanded(page.read_text(), name)
    assert "curveline keys new" in hooks.expanded((ROOT / "docs" / "firmware.md").read_text(), "firmware.md")


def test_pictures_are_as_they_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs" / "images")
    import draw

    for name, drawn in draw.pictures().items():
        kept = (ROOT / "docs" / "images" / name).read_text()
        assert re.sub(r"-?\d+\.\d", "", drawn) == re.sub(r"-?\d+\.\d", "", kept)
        numbers = [[float(each) for each in re.findall(r"-?\d+\.\d", text)] for text in (drawn, kept)]
        assert numbers[0] == pytest.approx(numbers[1], abs=0.2)


def test_the_project_is_named_alike_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = (ROOT / "CITATION.cff").read_text()
    assert f"version: {curveline.__version__}\n" in citation
    assert f"license: {project['license']}\n" in citation
    assert project["authors"] == [{"name": "curveline developers"}]
    assert "curveline developers" in (ROOT / "LICENSE").read_text()
    platforms = (ROOT / "docs" / "platforms.md").read_text()
    assert all(f"| `{extra}` |" in platforms for extra in project["optional-dependencies"])


def test_the_shell_blocks_are_whole() -> None:
    """What a page shows as a shell command is one that a shell can read."""
    for page in PAGES:
        for block in printed.blocks(page):
            if block.kind == "sh":
                shlex.split(block.text, comments=True)
