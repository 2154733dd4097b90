"""Which files of tests are begun first where several processes share them: what takes longest."""

from __future__ import annotations

from pathlib import Path

HERE = Path(__file__).parent
LONGEST_FIRST = (
    "cli/test_display.py",
    # While the first process compiles the kernels, the others do what needs none.
    "radio/model/test_model.py",
    "firmware/test_node_homing.py",
    "radio/test_simulation.py",
    "firmware/test_node_image.py",
    "firmware/test_conformance.py",
    "radio/test_contract.py",
    "firmware/test_fuzz.py",
    "radio/test_unplugged.py",
    "radio/test_coverage.py",
    # These compile more of them.
    "figures/test_falls.py",
    "completeness/test_space.py",
    # What starts other processes waits for nobody's kernels: now they are there.
    "test_advice_works.py",
    "cli/test_system_errors.py",
    "platforms/test_platforms.py",
    "test_documents.py",
    "cli/test_ways_out.py",
    "cli/test_terminal.py",
    "cli/test_sweep.py",
    "simulation/test_space_states.py",
    "cli/test_landing.py",
    "planning/test_planning.py",
    "test_outputs.py",
    "test_end_to_end.py",
    "cli/test_load.py",
    "driving/test_lines_company.py",
    "driving/test_lines_killed.py",
    "driving/test_lines.py",
)


def place(path: Path) -> int:
    """The place of a file in that order; those that are not named follow as they come."""
    name = path.relative_to(HERE).as_posix() if path.is_relative_to(HERE) else ""
    return LONGEST_FIRST.index(name) if name in LONGEST_FIRST else len(LONGEST_FIRST)
