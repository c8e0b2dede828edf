"""A small numeric radiosity of an infinite street canyon, the reference for the tracer."""

import itertools

import numpy as np
from scenes import scene_of_triangles


def crossed_strings(a, b, c, d):
    """View factor from strip ab to strip cd, infinitely long (Hottel's crossed strings)."""

    def length(p, q):
        return np.hypot(*(np.subtract(p, q)))

    return (length(a, c) + length(b, d) - length(a, d) - length(b, c)) / (2 * length(a, b))


def canyon_after_bounces(height, width, albedo, bounces, strips=80):
    """Mean irradiance of wall and ground per isotropic sky after 0, 1, … bounces.

    Returns
    -------
    wall, ground : (bounces + 1,) float
    """
    up = np.linspace(0, height, strips + 1)
    over = np.linspace(0, width, strips + 1)
    # Every strip runs so that the open side of the canyon lies to its left.
    ground = [((x0, 0), (x1, 0)) for x0, x1 in itertools.pairwise(over)]
    right = [((width, z0), (width, z1)) for z0, z1 in itertools.pairwise(up)]
    left = [((0, z1), (0, z0)) for z0, z1 in itertools.pairwise(up)]
    pieces = ground + right + left
    face = [0] * strips + [1] * strips + [2] * strips
    factors = np.zeros((len(pieces), len(pieces)))
    for i, j in np.ndindex(factors.shape):
        if face[i] != face[j]:
            factors[i, j] = abs(crossed_strings(*pieces[i], *pieces[j][::-1]))
    sky = 1 - factors.sum(axis=1)
    arriving, total, rows = sky, sky.copy(), [sky.copy()]
    for _ in range(bounces):
        arriving = factors @ (albedo * arriving)
        total = total + arriving
        rows.append(total.copy())
    rows = np.array(rows)
    return rows[:, strips : 2 * strips].mean(axis=1), rows[:, :strips].mean(axis=1)


def bowl(steps=24):
    """The inside of a half sphere that opens upwards: each point sees the sky with half of its
    hemisphere.
    """
    angle = np.linspace(0, 2 * np.pi, 4 * steps, endpoint=False)
    depth = np.linspace(0, np.pi / 2, steps + 1)[1:, None]
    rings = np.stack(
        [np.sin(depth) * np.cos(angle), np.sin(depth) * np.sin(angle), 0 * angle - np.cos(depth)],
        axis=-1,
    )
    vertices = 10 * np.concatenate([[[0, 0, -1.0]], *rings])
    count, triangles = len(angle), []
    for side in range(count):
        following = (side + 1) % count
        triangles.append([0, 1 + side, 1 + following])
        for ring in range(steps - 1):
            lower, upper = 1 + ring * count, 1 + (ring + 1) * count
            triangles += [
                [lower + side, upper + side, upper + following],
                [lower + side, upper + following, lower + following],
            ]
    return scene_of_triangles(vertices, triangles)
