"""Kernels that tell whether a curve crosses itself or its own tails, and how near to itself it comes.

Both questions about a curve and itself go down a binary tree of boxes around runs of edges (Gottschalk, Lin and Manocha
1996), so that their cost grows with the vertices and not with their pairs: most pairs of runs are out of the question.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.geometry.vertex_table import ANGLE, X, Y

APART = 0.2
"""Parts of a curve nearer than this fraction of its length along it are neighbours, not a contact."""
LEAF = 8
"""Edges in the smallest box."""


@njit
def _cross(ax, ay, bx, by, cx, cy, dx, dy):
    """True if the straight pieces a-b and c-d cross each other inside."""
    first = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    second = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    third = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    fourth = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    return first * second < 0.0 and third * fourth < 0.0


@njit
def box_tree(table):
    """Boxes (2p, 4): x low, x high, y low, y high. Node k's children: 2k, 2k + 1; leaf p + i: edges from 8i."""
    m = table.shape[0] - 1
    leaves = 1
    while leaves * LEAF < m:
        leaves *= 2
    boxes = np.empty((2 * leaves, 4))
    for i in range(leaves):
        box = boxes[leaves + i]
        box[0], box[1], box[2], box[3] = np.inf, -np.inf, np.inf, -np.inf
        for j in range(i * LEAF, min(m, (i + 1) * LEAF) + 1 if i * LEAF < m else 0):
            box[0] = min(box[0], table[j, X])
            box[1] = max(box[1], table[j, X])
            box[2] = min(box[2], table[j, Y])
            box[3] = max(box[3], table[j, Y])
    for k in range(leaves - 1, 0, -1):
        for side in (0, 2):
            boxes[k, side] = min(boxes[2 * k, side], boxes[2 * k + 1, side])
            boxes[k, side + 1] = max(boxes[2 * k, side + 1], boxes[2 * k + 1, side + 1])
    return boxes


@njit
def _run(node, leaves, m):
    """First edge of a tree's node and the edge after its last."""
    first = node
    last = node
    while first < leaves:
        first = 2 * first
        last = 2 * last + 1
    return min(m, (first - leaves) * LEAF), min(m, (last - leaves + 1) * LEAF)


@njit
def _gap(a, b):
    """Square of the distance between two boxes; 0 where they overlap or touch."""
    x = max(0.0, a[0] - b[1], b[0] - a[1])
    y = max(0.0, a[2] - b[3], b[2] - a[3])
    return x * x + y * y


@leaf
def _apart(table, i, j):
    """Square of the distance between two vertices."""
    x, y = table[i, X] - table[j, X], table[i, Y] - table[j, Y]
    return x * x + y * y


@njit
def _split(stack, top, a, b, leaves):
    """Put the pairs of children of the pair of nodes a <= b on the stack; returns its new top."""
    if a == b:
        pairs = ((2 * a, 2 * a), (2 * a, 2 * a + 1), (2 * a + 1, 2 * a + 1))
    elif a < leaves:
        # Both nodes are of one level, so that they reach the leaves together.
        for i in range(2):
            for j in range(2):
                stack[top, 0], stack[top, 1] = 2 * a + i, 2 * b + j
                top += 1
        return top
    else:
        return top
    for pair in pairs:
        stack[top, 0], stack[top, 1] = pair
        top += 1
    return top


@shipped(Matrix)
def crosses_itself(table):
    """True if the polygon through the vertices `table (m+1, 4)` crosses itself.

    A run of edges that turns by less than pi in all cannot, which settles nearly all neighbouring runs.
    """
    m = table.shape[0] - 1
    boxes = box_tree(table)
    leaves = boxes.shape[0] // 2
    turned = np.zeros(m + 1)
    for i in range(1, m):
        ax, ay = table[i, X] - table[i - 1, X], table[i, Y] - table[i - 1, Y]
        bx, by = table[i + 1, X] - table[i, X], table[i + 1, Y] - table[i, Y]
        turned[i] = turned[i - 1] + abs(np.arctan2(ax * by - ay * bx, ax * bx + ay * by))
    turned[m] = turned[m - 1]
    stack = np.empty((256, 2), dtype=np.int64)
    stack[0] = 1
    top = 1
    while top > 0:
        top -= 1
        a, b = stack[top, 0], stack[top, 1]
        first, first_end = _run(a, leaves, m)
        second, second_end = _run(b, leaves, m)
        if second >= second_end or _gap(boxes[a], boxes[b]) > 0.0:
            continue
        if turned[second_end - 1] - turned[first] < 3.1:
            continue
        if a < leaves:
            top = _split(stack, top, a, b, leaves)
            continue
        for i in range(first, first_end):
            for j in range(max(second, i + 2), second_end):
                if _cross(
                    table[i, X], table[i, Y], table[i + 1, X], table[i + 1, Y],
                    table[j, X], table[j, Y], table[j + 1, X], table[j + 1, Y],
                ):  # fmt: skip
                    return True
    return False


@shipped(Matrix, float)
def crosses_tails(table, tail):
    """True if the polygon crosses the straight pieces of length `tail` that lead away from its ends backwards."""
    m = table.shape[0] - 1
    for end in range(2):
        at = 0 if end == 0 else m
        away = -tail if end == 0 else tail
        tip_x = table[at, X] + away * np.cos(table[at, ANGLE])
        tip_y = table[at, Y] + away * np.sin(table[at, ANGLE])
        for j in range(m):
            # The edge at the tail's own root only touches it.
            if (end == 0 and j == 0) or (end == 1 and j == m - 1):
                continue
            if _cross(
                table[at, X], table[at, Y], tip_x, tip_y,
                table[j, X], table[j, Y], table[j + 1, X], table[j + 1, Y],
            ):  # fmt: skip
                return True
    return False


@njit
def clearance(table):
    """Smallest distance between vertices that are at least `APART` of the length from each other along the curve."""
    m = table.shape[0] - 1
    boxes = box_tree(table)
    leaves = boxes.shape[0] // 2
    along = np.zeros(m + 1)
    for i in range(m):
        along[i + 1] = along[i] + np.sqrt(_apart(table, i + 1, i))
    apart = APART * along[m] * (1.0 - 1e-9)
    nearest = _apart(table, m, 0)
    stack = np.empty((256, 2), dtype=np.int64)
    stack[0] = 1
    top = 1
    while top > 0:
        top -= 1
        a, b = stack[top, 0], stack[top, 1]
        first, first_end = _run(a, leaves, m)
        second, second_end = _run(b, leaves, m)
        if second >= second_end or along[second_end] - along[first] < apart or _gap(boxes[a], boxes[b]) >= nearest:
            continue
        if a < leaves:
            top = _split(stack, top, a, b, leaves)
            continue
        for i in range(first, first_end + 1):
            for j in range(second_end, second - 1, -1):
                if along[j] - along[i] < apart:
                    break
                nearest = min(nearest, _apart(table, i, j))
    return np.sqrt(nearest)
