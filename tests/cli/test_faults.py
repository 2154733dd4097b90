"""Some faults as people meet them: one line, a hint, exit code 3, no traceback; `radio/test_faults.py` has them all."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from curveline.radio.mock.fault_injection import MISHAPS

from .conftest import Run

FAULTS = [
    ("stall=1@step2", "node 1 has stalled in step 2: its extrude motor does not follow", "free what blocks it"),
    ("off=2@step1", "node 2 does not answer any more", "check its power"),
    ("jam@step1", "no node answers any more", "jamming"),
    ("gone@step2", "the radio does not answer this computer any more", "plug it in again"),
    ("disk=full@step1", "No space left on device", "free space"),
    ("chip=2", "node 2 is another device than the site knows", "curveline keys adopt"),
    ("unhomed=1", "node 1 does not know where it is", "`curveline node home 1`"),
]


@pytest.mark.parametrize(("setting", "says", "hint"), FAULTS, ids=[row[0] for row in FAULTS])
def test_a_fault_ends_a_send_with_code_3(run: Run, plan_file: Path, setting: str, says: str, hint: str) -> None:
    code, out, err = run("send", plan_file, "--radio", f"mock:{setting}", "--yes")
    assert (code, out) == (3, "")
    assert "Traceback" not in err
    (line,) = [line for line in err.splitlines() if line.startswith("error:")]
    assert says in line
    assert hint in err.splitlines()[-1]
    assert err.splitlines()[-1].startswith("hint:")


def test_faults_that_are_borne_end_a_send_well(run: Run, plan_file: Path) -> None:
    radio = "mock:twin=1,reset@step1,replug@step1,stranger=0.3,replay=0.3"
    code, out, _ = run("send", plan_file, "--radio", radio, "--yes", "--json")
    assert code in (0, 1), "the rod need not take the curve that this plan does not aim at"
    assert json.loads(out)["outcome"] == "done"


def test_a_wrong_setting_is_answered_with_the_right_one(run: Run) -> None:
    code, out, err = run("status", "--radio", "mock:stal=1@step2")
    assert (code, out) == (2, "")
    assert err.endswith("hint: did you mean stall? Written as stall=<node>@step<number>\n")
    for key, row in MISHAPS.items():
        if row.form.value != key:
            assert f"write it as {key}{row.form.value}" in run("status", "--radio", f"mock:{key}").err
    code, _, err = run("status", "--radio", "mock:off=9@step1")
    assert code == 2
    assert "there is no node 9" in err
