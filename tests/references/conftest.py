"""The report that `pytest -s tests/references` prints, and the fixture that fills it."""

from __future__ import annotations

import pytest

from .report import Report

REPORT = pytest.StashKey[Report]()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """With -s, one line per row: reference, ours and relative deviation where it is worst."""
    report = config.stash.get(REPORT, None)
    if report is not None and config.getoption("capture") == "no":
        terminalreporter.section("reference values")
        for line in report.lines():
            terminalreporter.write_line(line)


@pytest.fixture(scope="session")
def against(request: pytest.FixtureRequest) -> Report:
    """Compares numbers with a row of the reference table: `against("A Euler loads", ours, reference, within=1e-9)`."""
    return request.config.stash.setdefault(REPORT, Report())
