"""Compiles C for this machine, so that tests can load or run the firmware's portable parts.

The compiler is `$CC` if set, else `cc` or `gcc` where there is one, else the one that comes with the ziglang package:
a test never skips for want of a compiler. Products are kept in a folder of the user's own, named after a hash of
everything that went in, and are built again if they no longer are what they were.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

HERE = Path(__file__).parent
FIRMWARE = HERE.parents[1] / "firmware"
CORE = FIRMWARE / "core"
CACHE_VARIABLE = "CURVELINE_BUILD_CACHE"
"""Environment variable that names another folder for products."""

WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
STANDARD = ("-std=c11", "-O2", "-g", f"-I{CORE}", f"-I{HERE}")


class CompilerError(AssertionError):
    """A compiler did not take what it was given; the message is its own."""


def zig() -> list[str]:
    """The C compiler of the ziglang package, for tests that want a second compiler or another target."""
    return [sys.executable, "-m", "ziglang", "cc"]


@lru_cache(maxsize=1)
def compiler() -> tuple[str, ...]:
    """The command of the C compiler for this machine."""
    if chosen := os.environ.get("CC"):
        return tuple(shlex.split(chosen))
    for name in ("cc", "gcc"):
        if found := shutil.which(name):
            return (found,)
    return tuple(zig())


def gcc() -> str | None:
    """The path of gcc where there is one: its sanitizers are complete, those of other compilers may not be."""
    return shutil.which("gcc")


def shared_library(
    name: str, sources: Sequence[Path], flags: Sequence[str] = (), command: Sequence[str] | None = None
) -> Path:
    """Compile and link `sources` to a library for ctypes; `command` is another compiler than `compiler()`."""
    return _product(f"{name}.so", sources, ("-shared", "-fPIC", *flags), command or compiler())


@lru_cache
def _object_file(source: Path, flags: tuple[str, ...]) -> Path:
    return _product(f"{source.stem}.o", [source], ("-c", "-fPIC", *flags), compiler())


def object_file(source: Path, flags: Sequence[str] = ()) -> Path:
    """Compile one file to what `shared_library` takes as a source, for programs that differ in another file only."""
    return _object_file(source, tuple(flags))


def executable(
    name: str, sources: Sequence[Path], flags: Sequence[str] = (), command: Sequence[str] | None = None
) -> Path:
    """Compile and link `sources` to a program for this machine."""
    return _product(name, sources, tuple(flags), command or compiler())


def compiler_environment() -> dict[str, str]:
    """The environment to start a compiler in: what ziglang keeps between runs goes to our folder too."""
    return {**os.environ, "ZIG_GLOBAL_CACHE_DIR": str(cache_folder() / "zig")}


@lru_cache(maxsize=1)
def cache_folder() -> Path:
    """A folder that only this user can write to."""
    if chosen := os.environ.get(CACHE_VARIABLE):
        folder = Path(chosen).absolute()
        folder.mkdir(parents=True, exist_ok=True)
        return folder
    folder = Path(tempfile.gettempdir()) / f"curveline-build-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    facts = folder.lstat()
    if folder.is_symlink() or facts.st_uid != os.getuid() or facts.st_mode & 0o022:
        return Path(tempfile.mkdtemp(prefix="curveline-build-"))
    return folder


def _product(name: str, sources: Sequence[Path], flags: tuple[str, ...], command: Sequence[str]) -> Path:
    arguments = [*command, *STANDARD, *WARNINGS, *flags]
    folder = cache_folder() / _fingerprint(sources, arguments)
    product, witness = folder / name, folder / f"{name}.sha256"
    if _intact(product, witness):
        return product
    folder.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as work:
        fresh = Path(work) / name
        run_compiler([*arguments, *map(str, sources), "-o", str(fresh)])
        sealed = Path(work) / witness.name
        sealed.write_text(_digest(fresh))
        os.replace(fresh, product)
        os.replace(sealed, witness)
    return product


def run_compiler(arguments: Sequence[str], environment: Mapping[str, str] | None = None) -> None:
    """Run a compiler command; CompilerError with what it printed if it fails."""
    done = subprocess.run(
        arguments, env=environment or compiler_environment(), capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise CompilerError(f"{shlex.join(arguments)}\n{done.stdout}{done.stderr}")


def _intact(product: Path, witness: Path) -> bool:
    """Whether a product of an earlier run is still what the compiler wrote."""
    try:
        return _digest(product) == witness.read_text()
    except OSError:
        return False


def _fingerprint(sources: Sequence[Path], arguments: Sequence[str]) -> str:
    """Hash of the compiler, its arguments, the sources and every header that they could include."""
    folders = {FIRMWARE, HERE, *(source.parent for source in sources)}
    headers = {header for folder in folders for header in folder.rglob("*.h")}
    state = sha256(_version(tuple(arguments[:3])).encode())
    for part in (*arguments, *(str(source) for source in sources)):
        state.update(part.encode() + b"\0")
    for path in (*sources, *sorted(headers)):
        state.update(f"{path}\0".encode() + path.read_bytes() + b"\0")
    return state.hexdigest()[:32]


@lru_cache
def _version(command: tuple[str, ...]) -> str:
    """What the compiler says about itself: another one must not find the products of this one."""
    name = command[:3] if command[1:2] == ("-m",) else command[:1]
    asked = [*name, "version"] if name[1:] else [*name, "--version"]
    return subprocess.run(asked, env=compiler_environment(), capture_output=True, text=True, check=False).stdout


def _digest(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()
