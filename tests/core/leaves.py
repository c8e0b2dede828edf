"""Crowns for tests."""

import numpy as np

from citypv.core.city.crowns import extrude, unit_sphere
from citypv.core.city.scene import Crowns


def crowns_of(*shapes, area_density=None, trunks=()):
    """Crowns from (vertices, triangles) of each, and the indices of those that are trunks of the
    first tree.
    """
    start = np.cumsum([0, *(len(points) for points, _ in shapes)])
    count = np.array([len(faces) for _, faces in shapes])
    own = np.repeat(np.arange(len(shapes)), count)
    triangles = [faces + first for (_, faces), first in zip(shapes, start, strict=False)]
    return Crowns(
        vertices=np.concatenate([points for points, _ in shapes]).astype(float),
        triangles=np.concatenate(triangles).astype(np.int32),
        tree=np.where(np.isin(own, trunks), 0, own).astype(np.int32),
        trunk=np.isin(own, trunks),
        names=[f"tree {k}" for k in range(len(shapes))],
        height=np.array([np.ptp(points[:, 2]) for points, _ in shapes]),
        evergreen=np.zeros(len(shapes), bool),
        area_density=np.full(len(shapes), np.nan if area_density is None else area_density),
    )


def ball(middle, radius, subdivisions=3):
    """A sphere as (vertices, triangles)."""
    vertices, triangles = unit_sphere(subdivisions)
    return vertices * radius + middle, triangles


def box(low, high):
    """An axis-parallel box as (vertices, triangles)."""
    (x, y, z), (u, v, w) = low, high
    floor = np.array([[x, y, z], [u, y, z], [u, v, z], [x, v, z]], float)
    return extrude(floor, np.array([[0, 1, 2], [0, 2, 3]]), w - z)
