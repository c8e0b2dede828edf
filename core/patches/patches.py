"""Patches: the triangles of the scene as receivers and reflectors of light, and what their rays
follow from.

All of it follows from the triangle itself, its name or its place, so that an edit of the city
elsewhere changes none.
"""

import re
from dataclasses import dataclass, fields, replace
from numbers import Integral

import numpy as np

from ..city.find_ground import find_ground, find_resting_floors
from ..rays import random_numbers
from ..rays.faces import Faces
from ..settings.errors import InputError, check_array
from ..settings.tolerances import GEOMETRY


@dataclass
class Patches(Faces):
    """One row per triangle of the scene."""

    area: np.ndarray  # (p,) float64 [m²]
    key: np.ndarray  # (p,) uint64, key of the random numbers
    # (p,) uint32, points of the sequence that each replicate of its rays took before
    rays_before: np.ndarray
    points_before: np.ndarray  # (p,) uint32, points that its shadow points took before
    # (p,) uint64, the same for every seed: what is covered is geometry, not chance
    place_key: np.ndarray
    albedo: np.ndarray  # (p,) float32
    ground: np.ndarray  # (p,) bool, ground: points below it are in the earth
    receives: np.ndarray  # (p,) bool, false for footprints, closures, floors at rest and no area

    def take(self, chosen):
        """Some rows of the patches."""
        return Patches(
            **{field.name: getattr(self, field.name)[chosen] for field in fields(Patches)}
        )

    @staticmethod
    def of_scene(scene, albedo, seed):
        """Patches of a scene.

        Parameters
        ----------
        scene : Scene
        albedo : (t,) float
            Of each triangle.
        seed : int

        Raises
        ------
        InputError
            If an array is invalid; names it and the place in it.
        """
        scene.check()
        _check_seed(seed)
        albedo = check_array("albedo", albedo, (len(scene.triangles),), least=0, most=1)
        corners = np.asarray(scene.vertices, float)[scene.triangles]  # (t, 3, 3)
        faces, area = Faces.of_triangles(corners, scene.footprint, scene.other_sides)
        ground = find_ground(scene)
        # Random numbers follow from the seed and from the place of the triangle.
        key, place_key = _keys_of_triangles(scene, seed, 0)
        return Patches(
            **vars(faces),
            area=area,
            key=key,
            rays_before=np.zeros(len(area), np.uint32),
            points_before=np.zeros(len(area), np.uint32),
            place_key=place_key,
            albedo=albedo.astype(np.float32),
            ground=ground,
            receives=~scene.closure & ~find_resting_floors(scene, ground) & (area > 0),
        )

    def reseed(self, scene, seed):
        """Patches with the random numbers of another seed, and else as they are."""
        return replace(self, key=_keys_of_triangles(scene, seed)[0])

    def lie_in_earth(self, ray_scene, points):
        """Whether the first face straight above some points is the ground, hit from below.

        Parameters
        ----------
        points : (c, m, 3) float32 [m]

        Returns
        -------
        (c, m) bool
        """
        if not self.ground.any():
            return np.zeros(points.shape[:2], bool)
        up = np.tile(np.float32([0, 0, 1]), (points.shape[0] * points.shape[1], 1))
        above = ray_scene.trace_closest(points.reshape(-1, 3), up)
        return ((above >= 0) & self.ground[above] & (self.normal[above, 2] > 0)).reshape(
            points.shape[:2]
        )


def _keys_of_triangles(scene, *seeds):
    """One random key per triangle, from the name of its surface and its number there, or from its
    place.

    Returns
    -------
    list of (t,) uint64
        For each seed.
    """
    unnamed = "\x00"
    names = np.where(_find_made_up(scene), unnamed, np.array(scene.surfaces.surface_id, object))
    number = number_triangles(scene) if scene.number is None else scene.number
    own = random_numbers.mix(number.astype(np.uint64) + np.uint64(1))
    # The ground's -1 takes the last name.
    keys = random_numbers.keys_of_names([*names, unnamed], *seeds)
    return [random_numbers.mix(key[scene.surface_of_triangle] ^ own) for key in keys]


def number_triangles(scene):
    """What tells each triangle from the others of its surface: (t,) int64.

    Its index among them, or, on the ground and on surfaces whose names the reader made up, its
    place: neither the order of a file nor an edit elsewhere changes it.
    """
    surface = scene.surface_of_triangle
    order = np.argsort(surface, kind="stable")
    number = np.empty(len(surface), np.int64)
    number[order] = np.arange(len(surface)) - np.searchsorted(surface[order], surface[order])
    rows = np.flatnonzero(np.append(_find_made_up(scene), True)[surface])
    corners = np.asarray(scene.vertices, float)[scene.triangles[rows]]
    # Places are rounded to the accuracy, and moved off the ties that middles of corners in
    # millimetres have.
    cells = np.round(scene.site.to_files(corners.mean(axis=1)) / GEOMETRY.accuracy + 0.0123).astype(
        np.int64
    )
    # Random numbers repeat after squares of 10 m × 2¹⁰.
    cells[:, :2] %= 1_024_000  # so a city moved by whole squares of the ground stays the same
    cells[surface[rows] < 0, 2] = 0  # ground has one height at a place
    # Hardly any face is parallel to this vector: it tells which of two opposite sides one is.
    cells[:, 2] = 2 * cells[:, 2] + (
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        @ np.array([0.36, 0.48, 0.8])
        > 0
    )
    east, north, height = cells.view(np.uint64).T
    number[rows] = random_numbers.mix(
        random_numbers.mix(random_numbers.mix(east) ^ north) ^ height
    ).view(np.int64)
    return number


def _find_made_up(scene):
    """Surfaces whose names tell only their order in the file, for want of another or of a unique
    one: (n,) bool.
    """
    surfaces = scene.surfaces
    pairs = zip(surfaces.surface_id, surfaces.building_id, strict=True)
    # Behind their building's name they have what `city.assemble_city` appends.
    made_up = re.compile(r"(_\d+|.*~\d+)([#/].*)?")
    return np.array(
        [made_up.fullmatch(name.removeprefix(building)) is not None for name, building in pairs],
        bool,
    )


def _check_seed(seed, *, most_seed=2**32 - 1):
    """Raise an error if a seed is not valid."""
    if not (isinstance(seed, Integral) and 0 <= seed <= most_seed):
        raise InputError(
            "--seed", f"{seed!r} is not a seed", f"give a whole number from 0 to {most_seed}"
        )
