"""Kernels for unit quaternions (w, x, y, z), with which the edges of a spatial rod keep their material frames.

The columns of a frame's matrix are the directors m1, m2 and the tangent t. Products compose like matrices.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import leaf


@leaf
def multiply(a, b, out):
    """Overwrite `out (4,)` with the product of the quaternions `a` and `b`; it may be neither of them."""
    out[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    out[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    out[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    out[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]


@leaf
def between(a, b, out):
    """Overwrite `out (4,)` with the rotation from frame `a` to frame `b`, seen from `a`: conj(a) b, with w >= 0."""
    out[0] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    out[1] = a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2]
    out[2] = a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1]
    out[3] = a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]
    if out[0] < 0.0:
        for i in range(4):
            out[i] = -out[i]


@leaf
def matrix_of(q, out):
    """Overwrite `out (3, 3)` with the matrix of the quaternion `q (4,)`; its columns are m1, m2 and t."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[0, 0] = w * w + x * x - y * y - z * z
    out[0, 1] = 2.0 * (x * y - w * z)
    out[0, 2] = 2.0 * (x * z + w * y)
    out[1, 0] = 2.0 * (x * y + w * z)
    out[1, 1] = w * w - x * x + y * y - z * z
    out[1, 2] = 2.0 * (y * z - w * x)
    out[2, 0] = 2.0 * (x * z - w * y)
    out[2, 1] = 2.0 * (y * z + w * x)
    out[2, 2] = w * w - x * x - y * y + z * z


@leaf
def exponential(vector, out):
    """Overwrite `out (4,)` with the rotation about `vector (3,)` by its length [rad]."""
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    factor = 0.5 - angle**2 / 48.0 if angle < 1e-4 else np.sin(0.5 * angle) / angle
    out[0] = np.cos(0.5 * angle)
    for i in range(3):
        out[1 + i] = factor * vector[i]


@leaf
def logarithm(q, out):
    """Overwrite `out (3,)` with the vector whose `exponential` is `q (4,)`, with w >= 0; its length is at most pi."""
    sine = np.sqrt(q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    factor = 2.0 if sine < 1e-8 else 2.0 * np.arctan2(sine, q[0]) / sine
    for i in range(3):
        out[i] = factor * q[1 + i]


@leaf
def normalise(q):
    """Make the quaternion `q (4,)` a unit one again."""
    scale = 1.0 / np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    for i in range(4):
        q[i] *= scale


@leaf
def product(a, b):
    """The product of the quaternions `a` and `b`, of four numbers each: see `multiply`."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
        a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1],
    )


@leaf
def unit(q):
    """The quaternion `q`, four numbers, made a unit one again."""
    scale = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return scale * q[0], scale * q[1], scale * q[2], scale * q[3]


@leaf
def trued(q):
    """The quaternion `q`, four numbers, made a unit one again that is one but for rounding."""
    scale = 1.5 - 0.5 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return scale * q[0], scale * q[1], scale * q[2], scale * q[3]
