"""The C node and the Python one give the same answers, over random sequences of events; the campaign has a million."""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

from curveline.radio.protocol.codes import Fault, NodeState

from . import build, twin

SEQUENCES = 40_000
CAMPAIGN = 1_000_000
SHARES = 20
FIRST = 2026_11_22 * CAMPAIGN
"""Seed of the first sequence; the others follow."""

ENOUGH_FOR_A_MISTAKE = 60_000
QUICKLY = ("-O0", "-g0", "-w")
"""Mistakes are compiled without care: they make warnings, and live for a few sequences only."""
MISTAKES = (
    ("receive.c", "counter <= session->counter", "counter < session->counter"),
    ("receive.c", "counter >= CL_COUNTER_END", "counter > CL_COUNTER_END"),
    ("receive.c", "if (frame.hold_gen > session->hold_gen) session", "session"),
    ("receive.c", "if (frame->release > session->release) session", "session"),
    ("receive.c", "session->hold_gen > node->lift_above", "session->hold_gen >= node->lift_above"),
    ("receive.c", "frame->load_step != memory->started + 1", "false"),
    ("receive.c", "if (!same_order(memory, frame))", "if (false)"),
    ("receive.c", "if ((cl_node_moves(node) || node->memory.homing) && !owner_gone(node, now_ms)) return false;", ""),
    ("receive.c", "(cl_node_moves(node) || node->memory.homing)", "cl_node_moves(node)"),
    ("receive.c", "session->flags & CL_FLAG_RESUME && ", ""),
    ("receive.c", "CL_FLAG_RESUME && session->run_tag == node->memory.run_tag", "CL_FLAG_RESUME"),
    ("receive.c", "CL_FLAG_CLEAR && !cl_lost_position(node->memory.fault)", "CL_FLAG_CLEAR"),
    ("receive.c", "node->pending.handshake == handshake", "false"),
    ("receive.c", "*nonce, hello->run_tag}", "*nonce, 0}"),
    ("receive.c", "if (nonce->offers == CL_OFFERS_END - 1) return false;", ""),
    ("receive.c", "nonce->offers == CL_OFFERS_END - 1", "nonce->offers >= CL_OFFERS_END - 2"),
    ("receive.c", "memory->finished == memory->started && !cl_node_moves(node)", "memory->finished == memory->started"),
    ("receive.c", "frame.node == node->number && ", ""),
    ("receive.c", "tally->in_window > CL_FLOOD", "tally->in_window >= CL_FLOOD"),
    ("receive.c", " || now_ms < node->tally.deaf_until_ms", ""),
    (
        "receive.c",
        "if (now_ms >= said_ms + session->deadman_ms)",
        "if (now_ms > said_ms + session->deadman_ms)",
    ),
    ("receive.c", "if (now_ms >= said_ms + session->deadman_ms)", "if (false)"),
    ("receive.c", "identify(node, now_ms, session->handshake, session->run_tag);", "cl_node_reload(node, now_ms);"),
    (
        "receive.c",
        "    } else {\n        cl_node_reload(node, now_ms);\n    }\n}\n\n/* A frame is",
        "    }\n}\n\n/* A frame is",
    ),
    ("receive.c", "    tell_time(node, now_ms, session);\n        return false;", "        return false;"),
    (
        "receive.c",
        "    refuse(node, now_ms, verdict);\n    tell_time(node, now_ms, session);",
        "    refuse(node, now_ms, verdict);",
    ),
    ("receive.c", "if (said_ms > node->session.heard_ms) node->session", "node->session"),
    ("receive.c", "    if (said_ms > node->session.heard_ms) node->session.heard_ms = said_ms;\n", ""),
    ("receive.c", "if (!node->session.owns_run) begin_run(node);", ""),
    ("receive.c", "    session->heard_ms = now_ms - session->deadman_ms;", ""),
    ("receive.c", "if (!session->owns_run) {\n        node->silent", "if (true) {\n        node->silent"),
    ("receive.c", "node->memory.run_tag = node->session.run_tag;", ""),
    ("receive.c", "frame.order > session->order && may_home", "may_home"),
    ("receive.c", "frame.order > session->order && may_home", "frame.order >= session->order && may_home"),
    ("receive.c", "session->order = frame.order;", ""),
    ("receive.c", "!is_held && !node->session.owns_run", "!is_held"),
    ("receive.c", "return !is_held && ", "return "),
    ("receive.c", " / 1000) : UINT16_MAX", " / 1024) : UINT16_MAX"),
    ("receive.c", ".axes = memory->unhomed,", ""),
    ("receive.c", ".cause = memory->cause,", ""),
    (
        "node.c",
        "node->session.heard_ms + node->session.deadman_ms",
        "node->session.heard_ms + node->session.deadman_ms + 1",
    ),
    ("node.c", "if (at_ms < *next_ms) *next_ms", "*next_ms"),
    ("node.c", "memory->move_ms = cl_move_rest_ms(&node->move);", ""),
    ("node.c", " && !node->silent && !cl_node_held(node);", " && !cl_node_held(node);"),
    ("node.c", " && node->session.owns_run && !node->silent", " && !node->silent"),
    ("node.c", "status.now.finished = status.now.started = 0", "status.now.finished = 0"),
    (
        "node.c",
        "    cl_node_brake(node, now_ms);\n    abandon_homing(node, now_ms);",
        "    cl_node_brake(node, now_ms);",
    ),
    ("node.c", "    node->lift_above = node->session.hold_gen;\n    cl_node_halt", "    cl_node_halt"),
    ("node.c", "if (memory->homing >> axis & 1) memory->unhomed", "memory->unhomed"),
    ("node.c", "if (cl_homed(memory) && cl_lost_position(memory->fault))", "if (cl_lost_position(memory->fault))"),
    ("node.c", "axis ? 1u << (axis - 1) : CL_ALL_AXES", "CL_ALL_AXES"),
    (
        "node.c",
        "if (cl_node_moves(node) || memory->homing || memory->estop ||",
        "if (cl_node_moves(node) || memory->estop ||",
    ),
    ("node.c", "    cl_node_forget_run(node);\n    node->plant.seek", "    node->plant.seek"),
    ("node.c", "    if (memory->homing) return CL_STATE_HOMING;\n", ""),
    ("node.c", "        memory->fault_ms = now_ms;\n", ""),
    ("node.c", "node->ack_serial++;", ""),
    ("motion.c", "+ 2 * (uint64_t)begins_at * braking - braking * braking", "+ (uint64_t)begins_at * braking"),
    ("motion.c", "done + length) / (2 * length)", "done) / (2 * length)"),
    ("frames.c", "CL_POSITION_UNIT / 2) / CL_POSITION_UNIT", "0) / CL_POSITION_UNIT"),
    ("frames.c", "if (target.at[axis] < -CL_TARGET_LIMIT) return CL_REJECT_FIELD;", ""),
    ("frames.c", "(now - payload[1])", "(now + 1 - payload[1])"),
    ("frames.c", "axes == 0 || axes > CL_ALL_AXES || ", "axes > CL_ALL_AXES || "),
    ("frames.c", "!zero_from(payload, HOME_FIELDS_END)", "false"),
    *(
        (
            "frames.c",
            f"{before}    seal(payload, key, (uint64_t)frame->clock);",
            f"{before}    seal(payload, key, (uint16_t)frame->clock);",
        )
        for before in ("put_condition(payload + 10, payload + 16, &frame->now);\n", "payload[11] = frame->index;\n")
    ),
    ("frames.c", "frame->axes.of[0] | frame->axes.of[1] << 4", "frame->axes.of[1] | frame->axes.of[0] << 4"),
    ("receive.c", "session->stopped ? CL_LIFT : 0", "0"),
    ("receive.c", "node->stopped = session->stopped;", "node->stopped = false;"),
    ("receive.c", "(node->session.hold_gen + 2u) & ~1u", "node->session.hold_gen"),
    (
        "receive.c",
        "        .stopped = node->stopped,\n        .on_trial = node->on_trial,\n    };\n    cl_encode_ident",
        "        .on_trial = node->on_trial,\n    };\n    cl_encode_ident",
    ),
    ("receive.c", "        .on_trial = node->on_trial,\n    };\n    cl_encode_ident", "    };\n    cl_encode_ident"),
    ("receive.c", "memory->homing,\n        .on_trial = node->on_trial,", "memory->homing,"),
    ("frames.c", " | frame->stopped << 2", ""),
    ("node.c", "status.now.staged = session->order;", "status.now.staged = 0;"),
    ("frames.c", " | frame->stopped << 4", ""),
    ("frames.c", " | frame->turning << 5", ""),
    ("errand.c", "node->session.owns_run || cl_node_moves(node) || ", "cl_node_moves(node) || "),
    (
        "errand.c",
        "node->session.deadman_ms > CL_SERVICE_DEADMAN_MS",
        "node->session.deadman_ms >= CL_SERVICE_DEADMAN_MS",
    ),
    ("errand.c", "memory->estop || node->silent || ", "memory->estop || "),
    ("errand.c", "frame->order <= node->session.order", "frame->order < node->session.order"),
    ("errand.c", "    cl_node_forget_run(node);\n", ""),
    ("errand.c", "    if (!frame->unhomed) return CL_OUTCOME_UNHOMED;\n", ""),
    ("errand.c", "    if (most > CL_UNHOMED_COUNTS) most = CL_UNHOMED_COUNTS;\n", ""),
    ("errand.c", "return within(axis, target) ? CL_OUTCOME_NONE : CL_OUTCOME_BEYOND;", "return CL_OUTCOME_NONE;"),
    ("errand.c", "frame->rate > CL_TURN_COUNTS", "frame->rate >= CL_TURN_COUNTS"),
    ("errand.c", "size(frame->amount) > CL_TURN_DUTY", "size(frame->amount) >= CL_TURN_DUTY"),
    ("errand.c", "    node->outcome = CL_OUTCOME_DONE;\n", ""),
    ("node.c", "there ? CL_OUTCOME_DONE : CL_OUTCOME_ENDED", "CL_OUTCOME_DONE"),
    ("node.c", "    cl_node_end_errand(node, CL_OUTCOME_FAILED);\n", ""),
    ("node.c", "        cl_node_end_errand(node, CL_OUTCOME_ENDED);\n        node->plant", "        node->plant"),
    ("node.c", "    if (cl_node_moves(node)) return CL_STATE_MOVING;\n", ""),
    ("frames.c", " && payload[11] < FLAGS_END", ""),
    ("frames.c", " && zero_from(payload, SERVICE_FIELDS_END)", ""),
    ("errand.c", "        if (node->on_trial) return;\n", ""),
    ("errand.c", "node->pieces |= (uint8_t)(1u << frame->index)", "node->pieces = (uint8_t)(1u << frame->index)"),
    ("errand.c", "frame->index > node->session.order", "frame->index >= node->session.order"),
    ("errand.c", "node->pieces != CL_ALL_PIECES", "node->pieces == 0"),
    (
        "errand.c",
        "        outcome = plant->store(plant->self, node->record);\n        node->pieces = 0;",
        "        outcome = plant->store(plant->self, node->record);",
    ),
    ("errand.c", "        node->leaves = node->on_trial;\n", ""),
    ("errand.c", "node->leaves = outcome == CL_OUTCOME_DONE;", "node->leaves = true;"),
    ("errand.c", "node->on_trial = outcome != CL_OUTCOME_DONE;", "node->on_trial = false;"),
    ("errand.c", "    if (node->on_trial) return CL_OUTCOME_OCCUPIED;\n", ""),
    (
        "errand.c",
        "if (node->on_trial) return ends ? CL_OUTCOME_NONE : CL_OUTCOME_OCCUPIED;",
        "if (node->on_trial) return CL_OUTCOME_NONE;",
    ),
    ("errand.c", "lacks || operation == CL_SETTINGS_KEEP", "lacks"),
    ("errand.c", "+ 999) / 1000", ") / 1000"),
    ("node.c", "    if (node->on_trial) next_ms = node->trial_ends_ms;\n", ""),
    ("node.c", "able && !node->on_trial &&", "able &&"),
    ("node.c", "memory->homing || memory->estop || node->on_trial", "memory->homing || memory->estop"),
    ("node.c", "if (node->trial_ends_ms == 0) node", "node"),
    ("receive.c", "    node->pieces = 0;\n", ""),
    ("receive.c", "memory->estop &&\n           !node->on_trial", "memory->estop"),
    ("receive.c", "node->leaves || now_ms", "now_ms"),
    ("frames.c", "payload[PIECE + i] ^ stream[i]", "payload[PIECE + i]"),
    ("frames.c", "index < CL_PIECES : zero_from(payload, PIECE)", "index < CL_PIECES : true"),
    ("frames.c", "operation > CL_SETTINGS_LOADER || ", ""),
    ("errand.c", "outcome = node->leaves ? CL_OUTCOME_DONE : CL_OUTCOME_BEYOND;", ""),
    ("frames.c", " | frame->on_trial << 6", ""),
    ("frames.c", "frame->on_trial << 3 | ", ""),
    ("keys.c", "cl_put32(message + 8, counter);", "cl_put32(message + 8, counter & 0xFF);"),
    ("keys.c", "if (nonce != 0)", "if (1)"),
    ("keys.c", "(nonce->offers - 1) % UINT16_MAX + 1", "nonce->offers"),
)


def run_share(library: Path, first: int, count: int) -> tuple[dict[str, int], str]:
    """Compare some sequences in a process of their own: what they reached, and the first difference."""
    harness = twin.Harness(library)
    found = harness.compare(first, count)
    return harness.noted(), twin.describe(harness, found) if found else ""


@pytest.mark.parametrize("sequences", [SEQUENCES, pytest.param(CAMPAIGN, marks=pytest.mark.campaign)])
def test_random_sequences_come_out_the_same(sequences: int) -> None:
    library, share = twin.library(), sequences // SHARES
    reached: dict[str, int] = {}
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as workers:
        shares = [workers.submit(run_share, library, FIRST + share * number, share) for number in range(SHARES)]
        for each in shares:
            noted, difference = each.result()
            if difference:
                workers.shutdown(cancel_futures=True)
                pytest.fail(difference)
            for name, count in noted.items():
                reached[name] = reached.get(name, 0) + count
    sys.stdout.writelines(f"{count:9} {name}\n" for name, count in reached.items())
    assert not [name for name in must_occur(reached) if reached[name] < sequences // 20_000]


def must_occur(reached: dict[str, int]) -> list[str]:
    """Outcomes, states, faults, events and spoiled frames without which the comparison would prove less."""
    wanted = {f"state {state}" for state in NodeState} | {f"fault {fault}" for fault in Fault}
    return [name for name in reached if name in wanted or not name.startswith(("state ", "fault "))]


@pytest.mark.parametrize(("name", "right", "wrong"), MISTAKES)
def test_a_mistake_in_the_c_core_is_found(tmp_path: Path, name: str, right: str, wrong: str) -> None:
    text = (build.CORE / name).read_text()
    assert text.count(right) == 1, "the mistake no longer fits the code"
    mistaken = tmp_path / name
    mistaken.write_text(text.replace(right, wrong))
    harness = twin.Harness(twin.library_with(mistaken, QUICKLY))
    found = harness.compare(FIRST, ENOUGH_FOR_A_MISTAKE)
    assert found is not None
    assert harness.differs(found.start, found.events)
    assert len(harness.shrunk(found).events) <= len(found.events)


def test_limits_and_identities_are_those_of_the_harness() -> None:
    """If they were not, the comparison would fail at once; here the reason shows."""
    text = (twin.FOLDER / "replay.c").read_text()
    for axes in twin.AXES:
        for axis in axes:
            assert f"{{{axis.low}, {axis.high}, {axis.speed}, {axis.acceleration}}}" in text
    for identity in twin.IDENTITIES:
        assert f"{{{identity.number}, 0x{identity.chip:08X}, " in text


@pytest.mark.campaign
def test_the_core_compiles_with_zig_too() -> None:
    build.shared_library("twin", [*twin.SOURCES, *twin.CORE_SOURCES], [f"-I{twin.FOLDER}"], build.zig())
