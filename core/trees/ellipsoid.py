"""Ellipsoids and prisms as closed triangle meshes, for trees that are given by numbers."""

import functools

import numpy as np

SUBDIVISIONS = 3  # 512 triangles; mean transmittance of a dense crown (k·LAD·diameter = 4) within 1 %


@functools.cache
def unit_sphere(subdivisions=SUBDIVISIONS):
    """Triangulated sphere whose volume is that of the unit sphere.

    Returns
    -------
    vertices : (v, 3) float64
    triangles : (t, 3) int64
    """
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    triangles = np.array(
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]], np.int64
    )
    for _ in range(subdivisions):
        vertices, triangles = halve_edges(vertices, triangles)
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    volume = np.einsum("ti,ti->", a, np.cross(b, c)) / 6
    return vertices * (4 / 3 * np.pi / volume) ** (1 / 3), triangles


def halve_edges(vertices, triangles):
    """Each triangle cut into four at the middles of its edges."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    unique, which = np.unique(edges, axis=0, return_inverse=True)
    ab, bc, ca = (which.reshape(-1) + len(vertices)).reshape(3, -1)
    a, b, c = triangles.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    finer = np.concatenate([np.column_stack(part) for part in parts])
    return np.concatenate([vertices, vertices[unique].mean(axis=1)]), finer


def ellipsoid(middle, half_axes):
    """Ellipsoid with axes along x, y, z: vertices (v, 3) [m] and triangles (t, 3)."""
    vertices, triangles = unit_sphere()
    return np.asarray(middle) + vertices * half_axes, triangles


def cylinder(foot, radius, height, sides=8):
    """Mantle of an upright cylinder: vertices (v, 3) [m] and triangles (t, 3)."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(sides)]) + foot
    k, following = np.arange(sides), (np.arange(sides) + 1) % sides
    lower = np.column_stack([k, following, k + sides])
    upper = np.column_stack([following, following + sides, k + sides])
    return np.concatenate([ring, ring + np.array([0, 0, height])]), np.concatenate([lower, upper])


def extrude(vertices, triangles, height):
    """Closed body between triangles that face upwards and the same ones raised by `height` [m]."""
    count = len(vertices)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    keys = set(map(tuple, edges.tolist()))
    begin, end = np.array([edge for edge in edges.tolist() if (edge[1], edge[0]) not in keys]).reshape(-1, 2).T
    walls = [np.column_stack([begin, end, end + count]), np.column_stack([begin, end + count, begin + count])]
    return (
        np.concatenate([vertices, vertices + np.array([0, 0, height])]),
        np.concatenate([triangles[:, ::-1], triangles + count, *walls]),
    )
