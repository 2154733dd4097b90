"""The locator points at every key and value of any TOML document, and never fails on text that is none."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from curveline.shapes.toml_location import MAX_DEPTH, KeyPath, TomlMap

ROOT = Path(__file__).parents[2]

TRICKY = '''\
# [not.a.table]
title = "a # no comment = \\" [x]" # a comment with a = b
'quoted key' = 1
"esc\\u0061ped" = 2
dotted . "two parts" . three = { inline = [1, 2], "deep.er".x = true }
when = 1979-05-27 07:32:00Z
text = """
[[no]]
key = "value" \\""" ""still inside"""""
raw = \'\'\'
a = 1 # 'inside'
\'\'\'
numbers = [ # first
  [ 1, 2, ],
  # [ 9 ]
  [ "]", '}', ], 3.5,
]

[table.sub]
a = 1
[ table ]
b = 2
[[items]]
a = 1
[[items.parts]]
size = 1
[[items.parts]]
size = 2
[items.more]
x = 3
[[items]]
[[items.parts]]
size = 4
'''

EXPECTED: list[tuple[KeyPath, str]] = [
    (("title",), '"a # no'),
    (("quoted key",), "1\n"),
    (("escaped",), "2\n"),
    (("dotted", "two parts", "three"), "{ inline"),
    (("dotted", "two parts", "three", "inline", 1), "2]"),
    (("dotted", "two parts", "three", "deep.er", "x"), "true"),
    (("when",), "1979"),
    (("text",), '"""\n[[no]]'),
    (("raw",), "'''\na"),
    (("numbers",), "[ # first"),
    (("numbers", 0), "[ 1"),
    (("numbers", 0, 1), "2, ]"),
    (("numbers", 1), '[ "]"'),
    (("numbers", 1, 1), "'}'"),
    (("numbers", 2), "3.5"),
    (("table", "sub"), "[table.sub]"),
    (("table", "sub", "a"), "1\n[ table"),
    (("table",), "[ table ]"),
    (("table", "b"), "2\n[[items"),
    (("items", 0), "[[items]]\na"),
    (("items", 0, "a"), "1\n[[items.parts]]\nsize = 1"),
    (("items", 0, "parts", 1), "[[items.parts]]\nsize = 2"),
    (("items", 0, "parts", 1, "size"), "2\n"),
    (("items", 0, "more", "x"), "3\n"),
    (("items", 1), "[[items]]\n[[items"),
    (("items", 1, "parts", 0, "size"), "4\n"),
]


def rest_of(text: str, position: tuple[int, int]) -> str:
    """The text from a line and column on."""
    line, column = position
    return "\n".join(text.split("\n")[line - 1 :])[column - 1 :]


def leaves(value: Any, path: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    """Every value of a document that holds no further ones, with its path."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from leaves(item, (*path, key))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from leaves(item, (*path, index))
    else:
        yield path, value


@pytest.mark.parametrize(("path", "beginning"), EXPECTED, ids=[repr(path) for path, _ in EXPECTED])
def test_tricky_document(path: KeyPath, beginning: str) -> None:
    tomllib.loads(TRICKY)
    assert rest_of(TRICKY, TomlMap(TRICKY).value_position(path)).startswith(beginning)


@pytest.mark.parametrize(
    ("path", "beginning"),
    [
        (("quoted key",), "'quoted"),
        (("escaped",), '"esc'),
        (("dotted", "two parts"), '"two parts"'),
        (("dotted", "two parts", "three", "deep.er", "x"), "x = true"),
        (("table", "sub"), "sub]"),
        (("items", 0, "more"), "more]"),
        (("items", 1), "[[items]]\n[[items"),
    ],
    ids=repr,
)
def test_keys(path: KeyPath, beginning: str) -> None:
    assert rest_of(TRICKY, TomlMap(TRICKY).key_position(path)).startswith(beginning)


def test_a_missing_value_is_placed_at_the_table_around_it() -> None:
    found = TomlMap(TRICKY)
    assert found.value_position(("items", 0, "more", "nothing")) == found.value_position(("items", 0, "more"))
    assert found.value_position(("nothing",)) == (1, 1)
    assert found.key_position(("items", 0, "more", "nothing")) == found.value_position(("items", 0, "more"))


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("a = 1\nb = 2\n'a' = 3\n", (3, 1)),
        ("a = {b = 1, c = 2, b = 3}", (1, 20)),
        ("[a]\nb = 1\n[c]\n[a]", (4, 2)),
        ("a.b = 1\na.c = 2\na.b = 3", (3, 3)),
    ],
)
def test_the_second_of_two_equal_keys(text: str, place: tuple[int, int]) -> None:
    with pytest.raises(tomllib.TOMLDecodeError):
        tomllib.loads(text)
    found = TomlMap(text)
    assert found.repeated is not None
    assert found.position(found.repeated[1]) == place


@pytest.mark.parametrize(
    "text", [TRICKY, "a.b = 1\na.c = 2\n[d.e]\n[d]\n", "[[a]]\nb = 1\n[[a]]\nb = 2\n", "a = [{b=1}, {b=2}]"]
)
def test_no_key_of_a_valid_document_counts_as_repeated(text: str) -> None:
    tomllib.loads(text)
    assert TomlMap(text).repeated is None


@pytest.mark.parametrize("opening", ["[", "{a=", "a."])
def test_depth_is_bounded(opening: str) -> None:
    text = (opening if opening == "a." else f"a = {opening}") + opening * 400_000
    found = TomlMap(text)
    assert found.too_deep is not None
    assert max(map(len, found.values), default=0) <= MAX_DEPTH + 1


def test_every_value_of_the_project_files_is_found() -> None:
    files = [*ROOT.glob("shapes/*.toml"), *ROOT.glob("curveline/shapes/displays/*.toml"), ROOT / "pyproject.toml"]
    assert len(files) > 18
    for file in files:
        text = file.read_text(encoding="utf-8")
        found = TomlMap(text)
        for path, _ in leaves(tomllib.loads(text)):
            assert path in found.values, (file, path)


class Writer:
    """Writes a random document whose leaves are distinct integers, in all of TOML's spellings."""

    def __init__(self, seed: int) -> None:
        self.random = Random(seed)
        self.count = 1000
        self.names = 0

    def document(self) -> str:
        """A whole document."""
        return self.tables(self.tree(0), ())

    def tree(self, depth: int) -> dict[str, Any]:
        """Nested tables, lists of tables, lists and leaves."""
        keys = [self.name() for _ in range(self.random.randint(1, 4))]
        return {key: self.node(depth + 1) for key in keys}

    def node(self, depth: int) -> Any:
        choice = self.random.random()
        if depth > 4 or choice < 0.4:
            self.count += 1
            return self.count
        if choice < 0.65:
            return self.tree(depth)
        make = self.tree if self.random.random() < 0.5 else self.node
        return [make(depth + 1) for _ in range(self.random.randint(0, 3))]

    def name(self) -> str:
        self.names += 1
        return self.random.choice(["k", "with space ", "dot.", 'quo"te', "apo'", "back\\", "#", "[", "é", "-"]) + str(
            self.names
        )

    def key(self, name: str) -> str:
        if all(c.isascii() and (c.isalnum() or c in "-_") for c in name):
            return name
        if "'" not in name and self.random.random() < 0.5:
            return f"'{name}'"
        return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'

    def gap(self) -> str:
        return self.random.choice(["", " ", "\t "])

    def noise(self) -> str:
        """What may stand between statements, and between the items of an array."""
        return self.random.choice(["", "\n", "# a = [1, {\n", "#'''\n", '\n\n  # """ ]\n', " \n"])

    def inline(self, value: Any) -> str:
        if isinstance(value, dict):
            pairs = (f"{self.gap()}{self.key(k)}{self.gap()}={self.gap()}{self.inline(v)}" for k, v in value.items())
            return "{" + ",".join(pairs) + self.gap() + "}"
        if isinstance(value, list):
            items = [self.noise() + self.inline(item) + self.noise() for item in value]
            return "[" + ",".join(items) + (",\n" if items and self.random.random() < 0.3 else "") + "]"
        return str(value)

    def tables(self, tree: dict[str, Any], path: tuple[str, ...]) -> str:
        """`tree` as statements, the inline ones first, as a header ends the table before it."""
        late = {k: v for k, v in tree.items() if self.may_be_late(v) and self.random.random() < 0.6}
        text = ""
        for key, value in tree.items():
            if key not in late:
                text += self.statement(self.key(key), value)
        for key, value in late.items():
            header = f"{self.gap()}.{self.gap()}".join(map(self.key, (*path, key)))
            for item in value if isinstance(value, list) else [value]:
                opening, closing = ("[[", "]]") if isinstance(value, list) else ("[", "]")
                text += f"{self.noise()}\n{opening}{self.gap()}{header}{self.gap()}{closing} # [x]\n"
                text += self.tables(item, (*path, key))
        return text

    def may_be_late(self, value: Any) -> bool:
        is_list = isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)
        return is_list or isinstance(value, dict)

    def statement(self, key: str, value: Any) -> str:
        if isinstance(value, dict) and value and self.random.random() < 0.5:
            return "".join(self.statement(f"{key}{self.gap()}.{self.gap()}{self.key(k)}", v) for k, v in value.items())
        return f"{self.gap()}{key}{self.gap()}={self.gap()}{self.inline(value)}{self.gap()}# x\n{self.noise()}\n"


@settings(derandomize=True, max_examples=300, deadline=None, database=None)
@given(st.integers(0, 1 << 32))
def test_every_value_of_a_random_document_is_found(seed: int) -> None:
    text = Writer(seed).document()
    found = TomlMap(text)
    data = tomllib.loads(text)
    for path, value in leaves(data):
        assert path in found.values, (path, text)
        assert rest_of(text, found.value_position(path)).startswith(str(value)), (path, text)
    assert found.repeated is None


PIECES = st.sampled_from(
    ['"', "'", '"""', "'''", "[", "]", "[[", "{", "}", "=", ".", ",", "#", "\n", "\\", "a", "b", "1", " ", "é"]
)


@settings(derandomize=True, max_examples=1000, deadline=None, database=None)
@given(st.lists(PIECES, max_size=40).map("".join))
@example("")
@example("a")
@example('a = "\\')
@example("[")
@example('"\\uD800" = 1')
def test_any_text_is_survived_and_valid_text_is_complete(text: str) -> None:
    found = TomlMap(text)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return
    assert all(path in found.values for path, _ in leaves(data))
