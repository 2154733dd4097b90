"""Builds the dongle's program with the vendor's own core, or says what is missing for that and where to get it.

`make -C firmware dongle TEENSY=FOLDER BOARD=teensylc`; both may be left out. The vendor's files are no part of this
project and in no package index: they come with Teensyduino, or from its author's public repositories.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
CORE = HERE.parent / "core"
TRIPLE = "arm-none-eabi-"
TEENSYDUINO = (
    *(".arduino15/packages/teensy/hardware/avr/*", "Library/Arduino15/packages/teensy/hardware/avr/*"),
    *("AppData/Local/Arduino15/packages/teensy/hardware/avr/*", "arduino-*/hardware/teensy/avr"),
    ".platformio/packages/framework-arduinoteensy",
)
"""Where Teensyduino is put below a home folder."""
COMPILERS = (
    *(".arduino15/packages/teensy/tools/teensy-compile/*/arm/bin", "arduino-*/hardware/tools/arm/bin"),
    *("Library/Arduino15/packages/teensy/tools/teensy-compile/*/arm/bin", ".platformio/packages/toolchain-gccarm*/bin"),
)
SPI_FOLDERS = ("libraries/SPI", "SPI")
COMMON = (
    *("-Os", "-g", "-mthumb", "-ffunction-sections", "-fdata-sections", "-nostdlib", "-w"),
    *("-DARDUINO=10813", "-DTEENSYDUINO=159", "-DUSB_SERIAL", "-DLAYOUT_US_ENGLISH"),
)
CPLUSPLUS = ("-std=gnu++17", "-fno-exceptions", "-fno-rtti", "-felide-constructors", "-Wno-error=narrowing")
STRICT = ("-Wall", "-Wextra", "-Werror")
"""For our own sources."""


@dataclass(frozen=True)
class Board:
    """How a Teensy is compiled for."""

    core: str  # folder of the vendor's cores
    script: str  # for the linker
    flags: tuple[str, ...]


M4 = ("-mcpu=cortex-m4",)
M7 = ("-mcpu=cortex-m7", "-mfloat-abi=hard", "-mfpu=fpv5-d16")
BOARDS = {
    "teensylc": Board("teensy3", "mkl26z64.ld", ("-mcpu=cortex-m0plus", "-D__MKL26Z64__", "-DF_CPU=48000000")),
    "teensy32": Board("teensy3", "mk20dx256.ld", (*M4, "-D__MK20DX256__", "-DF_CPU=72000000")),
    "teensy40": Board("teensy4", "imxrt1062.ld", (*M7, "-D__IMXRT1062__", "-DARDUINO_TEENSY40", "-DF_CPU=600000000")),
}


@dataclass(frozen=True)
class Kit:
    """What was found; None is missing."""

    compiler: Path | None  # the folder of arm-none-eabi-g++
    has_libraries: bool  # newlib's small C and C++ libraries are there
    core: Path | None  # of the board
    spi: Path | None  # the SPI library


class Failed(Exception):
    """A compiler did not take what it was given; the message is its own."""


def find(teensy: str, board: Board) -> Kit:
    """Look for what is needed, in `teensy` if that is not empty, else where Teensyduino is usually put."""
    home = Path.home()
    roots = (
        [Path(teensy)] if teensy else [path for each in TEENSYDUINO for path in sorted(home.glob(each), reverse=True)]
    )
    cores = (root / "cores" / board.core for root in roots)
    libraries = (root / folder for root in roots for folder in SPI_FOLDERS)
    compiler = _compiler(home)
    return Kit(
        compiler,
        compiler is not None and all(_has(compiler, board, each) for each in ("nano.specs", "libstdc++_nano.a")),
        next((path for path in cores if (path / "Arduino.h").is_file()), None),
        next((path for path in libraries if (path / "SPI.h").is_file()), None),
    )


def _compiler(home: Path) -> Path | None:
    if found := shutil.which(f"{TRIPLE}g++"):
        return Path(found).parent
    folders = (path for each in COMPILERS for path in sorted(home.glob(each), reverse=True))
    return next((folder for folder in folders if (folder / f"{TRIPLE}g++").is_file()), None)


def _has(compiler: Path, board: Board, name: str) -> bool:
    command = [compiler / f"{TRIPLE}g++", board.flags[0], "-mthumb", f"-print-file-name={name}"]
    return "/" in subprocess.run(command, capture_output=True, text=True, check=False).stdout


def missing(kit: Kit, board: Board) -> Iterator[str]:
    """What is not there, and where to get it, a line each."""
    if kit.compiler is None:
        packages = "gcc-arm-none-eabi libstdc++-arm-none-eabi-newlib"
        yield f"the compiler {TRIPLE}g++: `apt install {packages}`, or Teensyduino's own"
    elif not kit.has_libraries:
        yield f"the C++ library of {kit.compiler / (TRIPLE + 'g++')}: `apt install libstdc++-arm-none-eabi-newlib`"
    if kit.core is None:
        yield (
            f"the vendor's core, cores/{board.core}/Arduino.h: install Teensyduino, or say where it is with "
            "TEENSY=FOLDER; or clone PaulStoffregen/cores into FOLDER/cores"
        )
    if kit.spi is None:
        yield (
            "the vendor's SPI library, libraries/SPI/SPI.h: it comes with Teensyduino; "
            "or clone PaulStoffregen/SPI into FOLDER/SPI"
        )


class Build:
    """One build in `folder`, with everything that it takes."""

    def __init__(self, board: Board, compiler: Path, core: Path, spi: Path, folder: Path) -> None:
        self._board, self._compiler, self._core, self._spi = board, compiler, core, spi
        self._folder = folder
        self._flags = (*board.flags, *COMMON, f"-I{core}", f"-I{spi}", f"-I{CORE}", f"-I{HERE}")

    def compile(self, source: Path, *flags: str) -> Path:
        """Compile a file; its object."""
        target = self._folder / f"{source.parent.name}-{source.name}.o"
        is_c = source.suffix in (".c", ".S")
        language = ("-x", "assembler-with-cpp" if source.suffix == ".S" else "c" if is_c else "c++")
        self._run(
            f"{TRIPLE}{'gcc' if is_c else 'g++'}",
            *self._flags,
            *(() if is_c else CPLUSPLUS),
            *flags,
            *language,
            "-c",
            str(source),
            "-o",
            str(target),
        )
        return target

    def link(self, objects: Sequence[Path], name: str) -> Path:
        """Link everything; the hex file for the loader."""
        elf, target = self._folder / f"{name}.elf", self._folder / f"{name}.hex"
        script = f"-T{self._core / self._board.script}"
        options = ("-Wl,--gc-sections,--defsym=__rtc_localtime=0", "--specs=nano.specs", script, "-mthumb", "-Os")
        self._run(f"{TRIPLE}g++", *self._board.flags, *options, "-o", str(elf), *map(str, objects), "-lm")
        self._run(f"{TRIPLE}objcopy", "-O", "ihex", "-R", ".eeprom", str(elf), str(target))
        return target

    def _run(self, program: str, *arguments: str) -> None:
        done = subprocess.run([self._compiler / program, *arguments], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise Failed(done.stdout + done.stderr)


def build(name: str, kit: Kit, folder: Path) -> Path:
    """The dongle's program for a board; Failed if a compiler objects."""
    board = BOARDS[name]
    if kit.compiler is None or kit.core is None or kit.spi is None:
        raise Failed("something is missing")
    folder.mkdir(parents=True, exist_ok=True)
    work = Build(board, kit.compiler, kit.core, kit.spi, folder)
    objects = [work.compile(HERE / "expects.cpp")]
    objects += [work.compile(each, *STRICT) for each in (CORE / "dongle.c", HERE / "sender.c")]
    objects.append(work.compile(HERE / "dongle.ino"))
    vendor = [each for each in sorted(kit.core.iterdir()) if each.suffix in (".c", ".cpp", ".S")]
    objects += [work.compile(each) for each in [*vendor, kit.spi / "SPI.cpp"]]
    return work.link(objects, f"dongle-{name}")


def main() -> int:
    """0 if the program was built, 1 if something is missing or does not compile."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--board", default="teensylc", choices=sorted(BOARDS))
    parser.add_argument("--teensy", default="", help="folder with cores/ and libraries/ of Teensyduino")
    parser.add_argument("--build", default="build/dongle", type=Path)
    options = parser.parse_args()
    kit = find(options.teensy, BOARDS[options.board])
    lacks = list(missing(kit, BOARDS[options.board]))
    if lacks:
        print(f"the dongle's program for {options.board} cannot be built here; missing:", file=sys.stderr)
        print(*(f"- {each}" for each in lacks), sep="\n", file=sys.stderr)
        print("or use the Arduino IDE: `make -C firmware/dongle` puts the sketch together for it", file=sys.stderr)
        return 1
    try:
        target = build(options.board, kit, options.build)
    except Failed as failed:
        print(failed, file=sys.stderr)
        return 1
    print(f"wrote {target}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
