"""The rules of the house, read off the source: who may import whom, who may print, how long things may get."""

from __future__ import annotations

import ast
import graphlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import curveline

ROOT = Path(curveline.__file__).parent
MODULES = sorted(ROOT.rglob("*.py"))

LEFT_TO_RIGHT = """
_version errors units phrases listening notebook system sections material scene drive_settings plan_file shapes drawings
kernels rod rod/geometry rod/planar rod/states rod/spatial/terms rod/spatial rod/models rod/branches
radio/protocol radio radio/site radio/node radio/host radio/mock radio/ports radio/measuring
simulation loading planning atlases fitting surfaces
cameras cameras/synthetic trial tracing comparing calibrating
replay displays figures outputs driving driving/lines driving/looking
notebook_listener bench/methods bench api writing
cli/printing cli/printing/progress cli/printing/help cli/printing/reports cli cli/commands cli/app
"""
ROOMS = LEFT_TO_RIGHT.split()
"""The folders and modules of the package, each of which may import those to its left."""

APART = {
    "kernels": set(ROOMS) - {"kernels", "errors"},
    "rod": set(ROOMS) - {"rod", "kernels", "units", "errors"},
    "radio": {"rod", "scene", "sections", "shapes"},
    "plan_file": {"shapes"},
}
"""What a part may not import, although it stands to its left."""

ONLY_IN = {
    "numba": {"kernels", "bench"},
    "llvmlite": {"kernels"},
    "scipy": {"rod"},
    "numpy": {
        "kernels",
        "rod",
        "atlases",
        "bench",
        "calibrating",
        "cameras",
        "comparing",
        "drawings",
        "figures",
        "fitting",
        "loading",
        "material",
        "planning",
        "replay",
        "simulation",
        "surfaces",
        "tracing",
        "trial",
    },
    "pydantic": {"shapes"},
    "typer": {"cli"},
    "matplotlib": set(),
    "rich": set(),
    "multiprocessing": {"system"},
    "dask": set(),
    "distributed": set(),
    "cv2": set(),
    "svgelements": set(),
    "ezdxf": set(),
    "PIL": set(),
    "trimesh": set(),
    "pyrf24": set(),
    "serial": set(),
}
"""Package -> the parts that may import it when they are imported themselves; others do it in the function of need."""

MODULE_LINES = 400
FUNCTION_LINES = 40
KERNEL_LINES = 100
PARAMETERS = 5
TYPER_HOOKS = ("app._show_version", "completion.install", "completion.show", "options.shorten")
"""What typer calls with the value of a flag."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


def part_of(path: Path) -> str:
    """The folder or module of the package that a file belongs to; empty for the package's own first lines."""
    first = path.relative_to(ROOT).parts[0].removesuffix(".py")
    return "" if first in ("__init__", "__main__") else first


def room_of(path: Path) -> str:
    """The innermost folder that a file is in, commands of one group in that of the commands; or the module itself."""
    *folders, _ = path.relative_to(ROOT).parts
    if path == ROOT / "cli" / "app.py":
        return "cli/app"
    return "/".join(folders[:2] if folders[:2] == ["cli", "commands"] else folders) or part_of(path)


def file_of(name: str) -> Path | None:
    """The file of the package in which a dotted name is defined."""
    while name.split(".")[0] == "curveline":
        path = ROOT.parent / Path(*name.split("."))
        if path.with_suffix(".py").exists():
            return path.with_suffix(".py")
        if path.is_dir():
            return path / "__init__.py"
        name = name.rpartition(".")[0]
    return None


def imports(tree: ast.AST) -> Iterator[tuple[ast.stmt, str]]:
    """Every import anywhere in a tree, as dotted names."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            assert node.module is not None
            yield from ((node, f"{node.module}.{alias.name}") for alias in node.names)


def run_on_import(tree: ast.Module) -> Iterator[ast.stmt]:
    """Statements that run when the module is imported; what only a type checker sees is none of them."""
    pending: list[ast.AST] = list(tree.body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.stmt):
            yield node
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            pending.extend(node.orelse)
        elif not isinstance(node, Function):
            pending.extend(ast.iter_child_nodes(node))


def functions(tree: ast.AST) -> Iterator[Function]:
    return (node for node in ast.walk(tree) if isinstance(node, Function))


def is_kernel(function: Function) -> bool:
    return any(
        ast.unparse(decorator).split("(")[0] in ("njit", "leaf", "shipped") for decorator in function.decorator_list
    )


def is_command(path: Path, function: Function) -> bool:
    """A typer command: its parameters are the user's options."""
    return part_of(path) == "cli" and function.name == path.stem


def code_lines(path: Path, function: Function) -> int:
    """Lines of a function without its docstring; of a command, the options do not count either."""
    first = function.body[0]
    has_docstring = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    begin = first.lineno if is_command(path, function) else function.lineno
    length = (function.end_lineno or 0) - begin + 1
    return length - ((first.end_lineno or 0) - first.lineno + 1 if has_docstring else 0)


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@pytest.fixture(params=MODULES, ids=name_of)
def module(request: pytest.FixtureRequest) -> tuple[Path, ast.Module]:
    return request.param, parsed(request.param)


def imported_by(path: Path) -> Iterator[tuple[ast.stmt, Path]]:
    """Every file of the package that another one imports, also within functions and for the type checker alone."""
    for node, name in imports(parsed(path)):
        target = file_of(name)
        if target is not None and target != path:
            yield node, target


def test_every_file_is_in_a_room() -> None:
    assert {room_of(path) for path in MODULES} - {""} == set(ROOMS)


def test_imports_lead_to_the_left(module: tuple[Path, ast.Module]) -> None:
    path, _ = module
    if not (room := room_of(path)):
        return
    for node, target in imported_by(path):
        assert ROOMS.index(room_of(target)) <= ROOMS.index(room), f"line {node.lineno}: {room} imports {target}"
        apart = APART.get(part_of(path), set())
        assert part_of(target) not in apart, f"line {node.lineno}: {part_of(path)} must not know {target}"


def test_no_file_imports_itself_by_way_of_others() -> None:
    graph = {path: {target for _, target in imported_by(path)} for path in MODULES}
    graphlib.TopologicalSorter(graph).prepare()


def test_a_class_name_is_bound_once() -> None:
    homes: dict[str, list[str]] = {}
    for path in MODULES:
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ClassDef):
                homes.setdefault(node.name, []).append(name_of(path))
    assert not {name: files for name, files in homes.items() if len(files) > 1}


def test_heavy_packages_are_imported_where_they_are_needed(module: tuple[Path, ast.Module]) -> None:
    path, tree = module
    for statement in run_on_import(tree):
        if isinstance(statement, ast.Import | ast.ImportFrom):
            for node, name in imports(statement):
                package = name.split(".")[0]
                assert part_of(path) in ONLY_IN.get(package, {part_of(path)}), f"line {node.lineno} imports {package}"


def test_no_part_of_the_radio_knows_numpy() -> None:
    for path in [*(ROOT / "radio").rglob("*.py"), ROOT / "plan_file.py"]:
        packages = {name.split(".")[0] for _, name in imports(ast.parse(path.read_text()))}
        assert not packages & {"numpy", "numba", "scipy"}, path


ONLY_SOMEWHERE = {
    "os": "O_BINARY O_CLOEXEC O_NOCTTY O_NONBLOCK fork getuid geteuid name posix_fallocate pread pwrite uname "
    "rename replace sched_getaffinity",
    "signal": "SIGALRM SIGBREAK SIGHUP SIGKILL SIGUSR1 alarm pthread_sigmask setitimer",
    "sys": "platform",
    "time": "CLOCK_BOOTTIME CLOCK_MONOTONIC clock_gettime clock_gettime_ns",
}
"""What not every system has, or what it does in its own way."""


def test_only_one_module_knows_the_system(module: tuple[Path, ast.Module]) -> None:
    path, tree = module
    if (
        name_of(path) == "system/portable.py" or part_of(path) == "bench"
    ):  # what runs and measures other programs is for Linux and macOS
        return
    names = {f"{part}.{name}" for part, names in ONLY_SOMEWHERE.items() for name in names.split()}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            assert ast.unparse(node) not in names, f"line {node.lineno}: {ast.unparse(node)}"
    packages = {name.split(".")[0] for _, name in imports(tree)}
    assert not packages & {"fcntl", "msvcrt", "pwd", "resource", "termios", "winreg"}


def test_only_the_command_line_prints_prompts_and_exits(module: tuple[Path, ast.Module]) -> None:
    path, tree = module
    if part_of(path) == "cli":
        return
    forbidden = {"print", "input", "exit", "quit", "sys.exit", "os._exit", "sys.stdout.write", "sys.stderr.write"}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            assert ast.unparse(node.func) not in forbidden, f"line {node.lineno}: {ast.unparse(node.func)}"
        if isinstance(node, ast.Raise) and node.exc is not None:
            assert "SystemExit" not in ast.unparse(node.exc), f"line {node.lineno}"


def test_modules_and_functions_stay_short(module: tuple[Path, ast.Module]) -> None:
    path, tree = module
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MODULE_LINES
    for function in functions(tree):
        limit = KERNEL_LINES if is_kernel(function) else FUNCTION_LINES
        assert code_lines(path, function) <= limit, f"{function.name} has {code_lines(path, function)} lines"


def test_functions_take_few_parameters_and_no_flags_by_position(module: tuple[Path, ast.Module]) -> None:
    path, tree = module
    for function in functions(tree):
        if is_kernel(function) or is_command(path, function):
            continue
        arguments = function.args
        positional = [each for each in arguments.posonlyargs + arguments.args if each.arg not in ("self", "cls")]
        count = len(positional) + len(arguments.kwonlyargs)
        assert count <= PARAMETERS, f"{function.name} takes {count} parameters"
        flags = [each.arg for each in positional if each.annotation and ast.unparse(each.annotation) == "bool"]
        is_typer_hook = part_of(path) == "cli" and f"{path.stem}.{function.name}" in TYPER_HOOKS
        assert not flags or is_typer_hook, f"{function.name} takes {flags} by position"


def test_everything_public_says_what_it_is(module: tuple[Path, ast.Module]) -> None:
    _, tree = module
    assert ast.get_docstring(tree), "the module"
    for node in tree.body:
        if isinstance(node, ast.ClassDef | Function) and not node.name.startswith("_"):
            assert ast.get_docstring(node), node.name


def test_unit_factors_live_in_one_place(module: tuple[Path, ast.Module]) -> None:
    path, tree = module
    if part_of(path) == "units":
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            assert ast.unparse(node.func) not in ("math.radians", "math.degrees", "np.deg2rad", "np.rad2deg"), (
                node.lineno
            )
