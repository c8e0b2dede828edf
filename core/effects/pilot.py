"""A pilot: random paths backwards from the surfaces whose numbers are wanted, which show where their light comes from.

Each path starts at a random point and goes on in a cosine-distributed direction. At every place it sends a ray towards
a random sun; where it escapes it meets the sky or the far ground; where it hits the front of a patch its weight is
multiplied with the albedo, and where crowns stand in its way with what they let through. So the light that arrives
after n reflections is the mean over all paths of what they find at place n (the Neumann series of the radiosity
equation, term by term).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..city.canopy import Canopy
from ..patches.fates_of_rays import measure_reach, meets_back
from ..rays.hemisphere_rays import points_of_patches, rays_from_patches
from ..rays.sample_points import cosine_direction
from ..sun.horizon import TerrainHorizon, is_above
from ..sun.horizon_band import SOURCES
from ..sun.suns import Suns

PATHS = 8192
FEWEST_PATHS = 256  # of each kind and orientation
LONGEST = 50  # reflections
NEGLIGIBLE = 1e-7  # weight below which a path ends
SKIES = (0.0, 4.0)  # direct normal over diffuse irradiance of a year: always overcast, and desert


@dataclass
class Surroundings:
    """What lights a scene, and what stands around it."""

    ground_albedo: float  # of the far ground; 0 without one
    suns: Suns | None
    canopy: Canopy | None = None  # without leaves, where trees lose them: then more light is reflected
    terrain: TerrainHorizon | None = None
    sources: tuple = ()  # of (HorizonBand, its light over that of the sky's dome)
    mirrors: object = None  # `specular.Mirrors`; None: every face reflects by Lambert's law

    def brightness(self, directions):
        """Radiance of the sky over that of its dome, in directions (m, 3): (m,) float64."""
        parts = [ratio * source.radiance * source.contains(directions) for source, ratio in self.sources]
        return np.ones(len(directions)) + sum(parts)


def surroundings_in(year, ground_albedo, **others):
    """Surroundings lit by a year, per light of the sky's dome: suns weigh as their normal irradiance.

    Parameters
    ----------
    year : SunlitYear
    ground_albedo : float
    others : dict
        Further fields of Surroundings.
    """
    none, dome = np.zeros(len(year.direct), np.int32), max(year.dome, 1e-9)
    suns = Suns("hourly", year.towards, year.direct / dome, none, none)
    sources = tuple((SOURCES[name], light / dome) for name, light in year.sources.items())
    return Surroundings(ground_albedo, suns, sources=sources, **others)


@dataclass
class Pilot:
    """Light found by m paths, each a row; column n is light that was reflected n times."""

    weight: np.ndarray  # (m,) float64, area that a path stands for over that of all receivers
    group: np.ndarray  # (m,) int, kind and orientation of the surface where it starts
    groups: list  # of str
    sky: np.ndarray  # (m, LONGEST + 1) float32, per DHI
    sun: np.ndarray  # (m, LONGEST + 1) float32, mean over the suns, per DNI; 0 where no suns are known
    far_sky: np.ndarray  # (m,) float32, the part of `sky` that the far ground reflected last
    far_sun: np.ndarray  # (m,) float32
    alive: np.ndarray  # (m,) float32, weight after the last reflection
    unshaded: np.ndarray  # (m,) float32, direct light of the same suns without shadows
    open_sun: np.ndarray  # (m, LONGEST + 1) float32, `sun` if nothing but terrain cast a shadow
    start: np.ndarray  # (m,) int, patch where the path starts
    inside: np.ndarray  # (m,) bool, paths that meet a back first: they start inside or under something
    first: np.ndarray  # (m,) int, patch that the path met first; -1: none
    rays: int


class Paths(NamedTuple):
    """Places at which k paths are that go on."""

    patch: np.ndarray  # (k,) int
    row: np.ndarray  # (k,) int, of the Pilot
    weight: np.ndarray  # (k,) float32
    b1: np.ndarray  # (k,) float32, barycentric weights of the point
    b2: np.ndarray  # (k,) float32
    arriving: np.ndarray  # (k, 3) float32, direction of travel on arrival; 0 where paths start


def trace_pilot(ray_scene, patches, scene, surroundings, seed, count=PATHS):  # noqa: PLR0917
    """Follow random paths from the eligible surfaces, or from all if none is eligible.

    Parameters
    ----------
    ray_scene : FacingScene
    patches : Patches
    scene : Scene
        Of these patches.
    surroundings : Surroundings
    seed : int
    count : int, optional
        Of paths, about.

    Returns
    -------
    Pilot or None
        None if no surface receives light.
    """
    start, weight, group, groups = draw_starts(patches, scene.triangle_surface, scene.surfaces, seed, count)
    if not len(start):
        return None
    generator = np.random.default_rng([seed, 0x9110])
    found = Pilot(
        weight,
        group,
        groups,
        *np.zeros((2, len(start), LONGEST + 1), np.float32),
        *np.zeros((4, len(start)), np.float32),
        open_sun=np.zeros((len(start), LONGEST + 1), np.float32),
        start=start,
        inside=np.zeros(len(start), bool),
        first=np.full(len(start), -1),
        rays=0,
    )
    rows = np.arange(len(start))
    nowhere = np.zeros((len(start), 3), np.float32)
    paths = Paths(start, rows, np.ones(len(start), np.float32), *random_points(generator, len(start)), nowhere)
    for order in range(LONGEST + 1):
        find_suns(ray_scene, patches, paths, surroundings, generator, order=order, found=found)
        paths = follow_paths(ray_scene, patches, paths, surroundings, generator, order=order, found=found)
        if not len(paths.patch):
            return found
    found.alive[paths.row] = paths.weight
    return found


def draw_starts(patches, owner, surfaces, seed, paths=PATHS):
    """Patches where paths start, by area in each kind and orientation.

    Returns
    -------
    start : (m,) int
    weight : (m,) float64
    group : (m,) int
    groups : list of str
    """
    names = np.char.add(np.char.add(np.asarray(surfaces.kind, str), " "), np.asarray(surfaces.orientation, str))
    wanted = surfaces.eligible if surfaces.eligible.any() else np.ones(len(names), bool)
    groups, number = np.unique(names[wanted], return_inverse=True) if len(names) else ([], np.zeros(0, int))
    of_surface = np.full(len(names) + 1, -1)  # the generated ground's -1 takes the last
    of_surface[:-1][wanted] = number
    of_patch = np.where(patches.receives & (patches.area > 0), of_surface[owner], -1)
    generator = np.random.default_rng([seed, 0x57A7])
    whole = patches.area[of_patch >= 0].sum()
    start, weight, group = [], [], []
    for index in range(len(groups)):
        members = np.flatnonzero(of_patch == index)
        if not len(members):
            continue
        own = patches.area[members].sum()
        count = max(FEWEST_PATHS * paths // PATHS, round(paths * own / whole))
        start.append(np.sort(generator.choice(members, count, p=patches.area[members] / own)))
        weight.append(np.full(count, own / whole / count))
        group.append(np.full(count, index))
    if not start:
        return np.zeros(0, int), np.zeros(0), np.zeros(0, int), []
    return np.concatenate(start), np.concatenate(weight), np.concatenate(group), [str(name) for name in groups]


def random_points(generator, count):
    """Barycentric weights of uniform points of triangles: two (count,) float32."""
    u, v = np.sort(generator.random((2, count), np.float32), axis=0)
    return u, v - u


def find_suns(ray_scene, patches, paths, surroundings, generator, *, order, found):
    """Add the light that reaches each path's place from one random sun."""
    suns, canopy = surroundings.suns, surroundings.canopy
    if suns is None or not len(suns):
        return
    mirrors = surroundings.mirrors
    if mirrors is not None:
        paths = Paths(*(part[~mirrors.turned(paths)] for part in paths))
    patch, path, weight, b1, b2, _ = paths
    share = np.maximum(suns.weight, 0)
    towards = suns.direction[generator.choice(len(suns), len(patch), p=share / share.sum())].astype(np.float32)
    cosine = np.maximum(np.einsum("ij,ij->i", towards, patches.normal[patch]), 0)
    before = np.flatnonzero(cosine > 0)
    origins = points_of_patches(patches, patch[before], b1[before, None], b2[before, None])[:, 0]
    above = is_above(surroundings.terrain, towards[before])
    free = (ray_scene.trace_closest(origins, towards[before]) < 0) & above
    if canopy is not None:
        free = free * canopy.transmittance(origins, towards[before])
    found.rays += len(before)
    found.sun[path[before], order] += weight[before] * cosine[before] * free
    found.open_sun[path[before], order] += weight[before] * cosine[before] * above
    if order == 0:
        found.unshaded[:] = cosine
    if mirrors is not None and order < LONGEST:
        places = points_of_patches(patches, patch, b1[:, None], b2[:, None])[:, 0], patches.normal[patch], towards
        by_mirror = mirrors.images(ray_scene, patches, places, surroundings, generator)
        found.sun[path, order + 1] += weight * by_mirror


def follow_paths(ray_scene, patches, paths, surroundings, generator, *, order, found):
    """Send each path on, and add what it finds of sky and far ground.

    Parameters
    ----------
    paths : Paths
    surroundings : Surroundings

    Returns
    -------
    Paths
        Those that go on, at their next places.
    """
    patch, path, weight, b1, b2, _ = paths
    ground_albedo, suns = surroundings.ground_albedo, surroundings.suns
    local = cosine_direction(*generator.random((2, len(patch), 1), np.float32))
    if surroundings.mirrors is not None:
        local, weight = surroundings.mirrors.turn(patches, paths, local, generator)
    origins, directions = rays_from_patches(patches, patch, b1[:, None], b2[:, None], local)
    directions = directions[:, 0]
    hit, b1, b2 = ray_scene.trace_places(origins[:, 0], directions)
    found.rays += len(patch)
    if surroundings.canopy is not None:
        reach = measure_reach(patches, origins, directions[:, None], (hit[:, None], b1[:, None], b2[:, None]))
        weight = weight * surroundings.canopy.transmittance(origins[:, 0], directions, reach[:, 0])
    upwards = (directions[:, 2] > 0) & is_above(surroundings.terrain, directions)
    sky, below = (hit < 0) & upwards, (hit < 0) & ~upwards
    found.sky[path[sky], order] += weight[sky] * surroundings.brightness(directions[sky])
    if order < LONGEST:
        found.sky[path[below], order + 1] += ground_albedo * weight[below]
        found.far_sky[path[below]] = ground_albedo * weight[below]
        if suns is not None and len(suns):
            height = height_of_suns(suns, surroundings.terrain)
            for suns_found in (found.sun, found.open_sun):
                suns_found[path[below], order + 1] += ground_albedo * weight[below] * height
            found.far_sun[path[below]] = ground_albedo * weight[below] * height
    weight = weight * patches.albedo[hit]
    back = (hit >= 0) & meets_back(patches, hit, directions)
    on = (hit >= 0) & ~back & (weight > NEGLIGIBLE)
    if order == 0:
        found.inside[path] = back
        found.first[path[on]] = hit[on]
    return Paths(hit[on], path[on], weight[on], b1[on], b2[on], directions[on])


def height_of_suns(suns, terrain):
    """Mean sine of the elevation of the suns, 0 where they are hidden."""
    seen = np.maximum(suns.direction[:, 2], 0) * is_above(terrain, suns.direction)
    return np.average(seen, weights=np.maximum(suns.weight, 0))
