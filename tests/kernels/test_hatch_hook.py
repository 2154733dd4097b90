"""An installation goes on without machine code where it cannot be made, and says so."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from curveline.kernels import object_file

ROOT = Path(__file__).parents[2]


class Told:
    """What hatch is told."""

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def display_info(self, text: str) -> None:
        """See hatch."""

    def display_warning(self, text: str) -> None:
        """See hatch."""
        self.warnings.append(text)


class Interface:
    """Of a hook, as hatch has it."""

    def __init__(self) -> None:
        self.root, self.app = str(ROOT), Told()


@pytest.fixture
def hook(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The hook, without hatch."""
    module: Any = ModuleType("hatchling.builders.hooks.plugin.interface")
    module.BuildHookInterface = Interface
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.delitem(sys.modules, "curveline.kernels.hatch_hook", raising=False)
    hook = import_module("curveline.kernels.hatch_hook").MachineCode()
    monkeypatch.delitem(sys.modules, "curveline.kernels.hatch_hook")
    return hook


def test_without_numba_a_wheel_is_made_without_machine_code(hook: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name in ("curveline.kernels.build", "curveline.kernels.entries")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "llvmlite", None)  # type: ignore[arg-type]
    data: dict[str, Any] = {"artifacts": []}
    hook.initialize("standard", data)
    (warning,) = hook.app.warnings
    assert "left to be compiled when they are called" in warning
    assert data == {"artifacts": []}


def test_a_wheel_takes_the_machine_code_and_nothing_that_lies_beside_it(
    hook: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert object_file.library() is not None
    hook.root = str(tmp_path)
    monkeypatch.setattr(object_file, "FOLDER", tmp_path / "machine_code")
    (tmp_path / "machine_code" / "left-over").mkdir(parents=True)
    (tmp_path / "machine_code" / object_file.INDEX).write_text('{"object": "0123456789abcdef0123"}')
    data: dict[str, Any] = {"artifacts": []}
    hook.initialize("standard", data)
    assert data["artifacts"] == ["machine_code/kernels.json", "machine_code/0123456789abcdef.o"]
    assert data["tag"].startswith("py3-none-")
