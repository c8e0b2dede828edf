"""Small scenes whose irradiance is known."""

import numpy as np

from citypv.core.city.classify import classify
from citypv.core.city.scene import Scene, Surfaces
from citypv.core.city.site import Site
from citypv.core.commands.plain_scenes import rectangle
from citypv.core.light.specular_light import trace_hybrid
from citypv.core.light.trace_forward import trace_forward
from citypv.core.light.trace_gather import trace_gather
from citypv.core.light.trace_hemisphere import trace_rows
from citypv.core.light.traced import RayCity, Traced
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sun.suns import Suns

strip = rectangle  # (start, along, across, count)


def scene_of_triangles(vertices, triangles, triangle_surface=None, *, thematic=None):
    """A scene whose surfaces are given by triangles, one surface per triangle unless said
    otherwise.
    """
    vertices, triangles = np.asarray(vertices, float), np.asarray(triangles, np.int32)
    own = np.arange(len(triangles)) if triangle_surface is None else np.asarray(triangle_surface)
    count = own.max() + 1
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    summed = (
        np.array([normal[own == surface].sum(axis=0) for surface in range(count)])
        if count < len(own)
        else normal
    )
    area = np.linalg.norm(summed, axis=1) / 2
    unit = summed / np.maximum(2 * area, 1e-300)[:, None]
    tilt = np.degrees(np.arccos(np.clip(unit[:, 2], -1, 1)))
    azimuth = np.degrees(np.arctan2(unit[:, 0], unit[:, 1])) % 360
    thematic = [""] * count if thematic is None else thematic
    kind, orientation, eligible = classify(area, tilt, azimuth, thematic)
    ids = [f"s{index}" for index in range(count)]
    surfaces = Surfaces(
        ids, ["b"] * count, thematic, kind, orientation, eligible, area, tilt, azimuth, unit
    )
    nothing = np.zeros(len(triangles), bool)
    site = Site(52.5, 13.4, 0.0, 0.0, None, (0.0, 0.0, 0.0))
    return Scene(vertices, triangles, own.astype(np.int32), nothing, nothing.copy(), surfaces, site)


def join(parts):
    """One scene from (vertices, triangles) parts; each triangle is a surface."""
    vertices, triangles, count = [], [], 0
    for points, faces in parts:
        vertices.append(points)
        triangles.append(np.asarray(faces) + count)
        count += len(points)
    return scene_of_triangles(np.concatenate(vertices), np.concatenate(triangles))


def suns_towards(directions):
    """Suns of equal weight in given directions."""
    directions = np.atleast_2d(np.asarray(directions, float))
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    count = len(directions)
    place = np.arange(count, dtype=np.int32)
    return Suns("hourly", directions, np.full(count, 1 / count), np.zeros(count, np.int32), place)


def run_gather(scene, suns, **settings):
    """Transfer of gather with some settings of a Request."""
    return trace_gather(scene, suns, Request(**settings), silent)


def trace_patches(ray_scene, patches, rows, samples, threads=1):
    """What the hemisphere rays of some patches, (r,) int, meet: Traced."""
    city = RayCity(ray_scene=ray_scene, patches=patches, threads=threads)
    found = Traced.empty(city)
    for part, *_ in trace_rows(city, rows, samples):
        found.put(part)
    return found


def run_forward(scene, suns, **settings):
    """Transfer of forward with some settings of a Request."""
    return trace_forward(scene, suns, Request(estimator="forward", **settings), silent)


def run_hybrid(scene, suns, **settings):
    """Transfer of gather with mirrors, with some settings of a Request."""
    return trace_hybrid(scene, suns, Request(**settings), silent)


RUNS = {"gather": run_gather, "forward": run_forward}


def rms(values, axis=None):
    """Root of the mean square."""
    return np.sqrt(np.mean(np.square(values), axis=axis))


def assert_mean(estimate, standard_error, expected, z=4):
    """The estimate lies within z standard errors of a value known in closed form."""
    distance = np.abs(np.asarray(estimate) - expected)
    assert (distance <= z * np.asarray(standard_error)).all(), (estimate, standard_error, expected)
