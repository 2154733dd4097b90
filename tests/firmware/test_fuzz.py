"""The C node's receive path fed damaged frames, most of them rightly signed, under the checkers of the compiler.

gcc's checkers for addresses and undefined behaviour are used where there is gcc; zig brings the latter only.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import pytest

from curveline.radio.protocol import codes, frames, page_frames
from curveline.radio.protocol.codes import BootCause, NodeState
from curveline.radio.protocol.frames import (
    DriveFrame,
    EstopFrame,
    HelloFrame,
    HomeFrame,
    IdentFrame,
    NodeNonce,
    ReportFrame,
    StatusFrame,
    StopFrame,
)
from curveline.radio.protocol.service_frames import ServiceFrame, encode_service
from curveline.radio.protocol.settings_frames import PIECE_BYTES, PIECES, SettingsFrame, encode_settings

from . import build, twin

EXECUTIONS = 500_000
CAMPAIGN = 50_000_000
SEEDS = (20261121, 20261123)
SOURCES = (twin.FOLDER / "fuzz.c", *twin.SOURCES)
KEY = bytes(range(16))


def fuzzer(core: Sequence[Path] = twin.CORE_SOURCES, gcc: str | None = None) -> Path:
    """The fuzzer with all the checks that the compiler has; any finding ends it with an error."""
    sanitizers = "address,undefined,bounds-strict" if gcc else "undefined"
    flags = [f"-I{twin.FOLDER}", f"-fsanitize={sanitizers}", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"]
    return build.executable("fuzz", [*SOURCES, *core], flags, [gcc] if gcc else build.zig())


@pytest.fixture(scope="module")
def checked() -> Path:
    return fuzzer(gcc=build.gcc())


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One frame of every kind with every sort of content that hosts and nodes send."""
    steps, holds = (0, 1, 2, 65535), (0, 1, 2, 3, 254, 255)
    targets = ((0, 0, 0), (221326, -5215, 48691), (codes.TARGET_LIMIT, -codes.TARGET_LIMIT, 1))
    found = [
        frames.encode_drive(DriveFrame(0, 1, 1, step, step, target, 100 * hold, hold), KEY)
        for step, hold, target in product(steps, holds, targets)
    ]
    found += [frames.encode_estop(EstopFrame(1, 1, counter), KEY) for counter in (1, codes.COUNTER_END - 1)]
    found += [frames.encode_home(HomeFrame(0, 1, 1, axes, axes), KEY) for axes in range(1, codes.ALL_AXES + 1)]
    found += [
        encode_service(ServiceFrame(0, 1, 1, operation, 1, 1, page, *flags, 200, 500, 400), KEY)
        for operation, page in product(codes.ServiceOperation, codes.ReadingPage)
        for flags in ((False, False), (True, True))
    ]
    orders = (operation for operation in codes.SettingsOperation if operation is not codes.SettingsOperation.PIECE)
    found += [encode_settings(SettingsFrame(0, 1, 1, operation, 1), KEY) for operation in orders]
    found += [
        encode_settings(SettingsFrame(0, 1, 1, codes.SettingsOperation.PIECE, index, KEY[:PIECE_BYTES]), KEY)
        for index in range(PIECES)
    ]
    found += [frames.encode_hello(HelloFrame(1, nonce << 8, 0x1111, 0, 1000, nonce), KEY) for nonce in range(16)]
    found += [frames.encode_stop(StopFrame(purpose), KEY) for purpose in (0, 1)]
    found += [page_frames.encode_ask(page_frames.AskFrame(node, 300)) for node in (1, codes.EVERY_NODE)]
    steps_and_state = (1, 1, 1, NodeState.READY, 0, codes.Fault.NONE, 0, (8, 8, 8))
    found.append(frames.encode_status(StatusFrame(1, 1, 1, 1, *steps_and_state), KEY))
    found.append(frames.encode_report(ReportFrame(1, 1, BootCause.PIN, *steps_and_state, (0, 15, 3), 1), KEY, 256))
    nonce = NodeNonce(1, 1, 1)
    found.append(
        frames.encode_ident(IdentFrame(1, nonce, 1, 1, 2, NodeState.READY, same_run=True, busy=False), KEY, 256)
    )
    path = tmp_path_factory.mktemp("corpus") / "frames"
    path.write_bytes(b"".join(found))
    return path


def fuzz(program: Path, corpus: Path, executions: int, seeds: Sequence[int] = SEEDS) -> None:
    """Run the fuzzer once per seed, all at the same time; findings and idle runs fail."""
    runs = [
        subprocess.Popen(
            [program, str(seed), str(executions), corpus], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        for seed in seeds
    ]
    for seed, run in zip(seeds, runs, strict=True):
        out, err = run.communicate()
        assert run.returncode == 0, f"seed {seed}, exit code {run.returncode}: {err}"
        accepted, states = int(out.split()[0]), int(out.split()[1], 16)
        print(f"seed {seed}: {executions} payloads, {accepted} accepted")
        assert accepted > executions // 4, "the fuzzer does not get in"
        assert states == sum(1 << state for state in NodeState if state is not NodeState.BOOT)


def test_damaged_frames_do_no_harm(checked: Path, corpus: Path) -> None:
    fuzz(checked, corpus, EXECUTIONS)


@pytest.mark.campaign
def test_a_hundred_million_damaged_frames_do_no_harm(checked: Path, corpus: Path) -> None:
    fuzz(checked, corpus, CAMPAIGN)


def mistaken(folder: Path, name: str, right: str, wrong: str) -> list[Path]:
    """The core with one mistake."""
    copy = folder / "core"
    shutil.copytree(build.CORE, copy)
    text = (copy / name).read_text()
    assert text.count(right) == 1, "the mistake no longer fits the code"
    (copy / name).write_text(text.replace(right, wrong))
    return [copy / source.name for source in twin.CORE_SOURCES]


def test_a_step_beyond_an_array_is_seen(tmp_path: Path, corpus: Path) -> None:
    core = mistaken(
        tmp_path,
        "motion.c",
        "axis < CL_AXES; axis++) {\n        if (target",
        "axis <= CL_AXES; axis++) {\n        if (target",
    )
    with pytest.raises(AssertionError, match="exit code"):
        fuzz(fuzzer(core, build.gcc()), corpus, 20_000, SEEDS[:1])


def test_a_short_payload_read_to_its_usual_end_is_seen(tmp_path: Path, corpus: Path) -> None:
    """Only the checker for addresses knows how long a payload was."""
    core = mistaken(tmp_path, "frames.c", "length != CL_FRAME_BYTES", "length < CL_BODY_BYTES")
    program = fuzzer(core, build.gcc())
    if build.gcc() is None:
        fuzz(program, corpus, 20_000, SEEDS[:1])
        return
    with pytest.raises(AssertionError, match="AddressSanitizer"):
        fuzz(program, corpus, 20_000, SEEDS[:1])


@pytest.mark.campaign
def test_zig_finds_undefined_behaviour_too(tmp_path: Path, corpus: Path) -> None:
    fuzz(fuzzer(), corpus, 20_000, SEEDS[:1])
    core = mistaken(tmp_path, "frames.c", "from[2] & 0x80 ? value - 0x1000000 : value", "value * 0x1000")
    with pytest.raises(AssertionError, match="exit code"):
        fuzz(fuzzer(core), corpus, 20_000, SEEDS[:1])
