"""What a tile's surroundings leave out at most, measured by rays from its own surfaces.

No sun below 2° is traced, so that direct sunlight misses nothing. A ray from an eligible surface that leaves the
surroundings less than 2° above the level may have met something that was left out: skylight is lost. One that leaves
downwards, or that meets the far surroundings, finds light that may be wrong in either way, by no more than it can be.
Edges of what was made coarser lie elsewhere by up to the sun's disc: of rays that are turned by as much, some then
meet what they passed before, or pass it.
"""

import numpy as np

from ..accuracy.part_of_city import draw_starts, random_points
from ..sampling.hemisphere_rays import rays_from_patches
from ..sampling.sample_points import cosine_direction
from ..scene.scene import FAR
from ..sky.light_sources import SOURCES
from ..sky.sky_models import split_sky
from .coarsen_surroundings import WIDTH
from .tiles import RISE

STREAM = 0x7E1E
SHARES = ("sky", "reflected", "edges")  # what `measure_halo` measures


def measure_halo(prepared, seed, part, city):
    """Shares of the hemispheres of a tile's eligible surfaces that may be wrong.

    Parameters
    ----------
    prepared : PreparedScene
        With its tree.
    seed : int
    part : Part
        The tile.
    city : tuple of two (2,) float64 [m]
        Bounds in plan of the whole scene: beyond them there is nothing to be left out.

    Returns
    -------
    dict
        `sky`, of the sky lower than 2°; `reflected`, of what reflects; `edges`, of what lies beside the edges of what
        was made coarser; cosine-weighted means over the eligible area. Empty without an eligible surface, or where
        nothing is left out or coarser.
    """
    if part.complete and not part.moved.any():
        return {}
    patches, scene = prepared.patches, prepared.scene
    start, weight, _, _ = draw_starts(patches, scene.triangle_surface, scene.surfaces, seed)
    if not scene.surfaces.eligible.any() or not len(start):
        return {}
    generator = np.random.default_rng([seed, STREAM])
    b1, b2 = random_points(generator, len(start))
    local = cosine_direction(*generator.random((2, len(start), 1), np.float32))
    origins, directions = rays_from_patches(patches, start, b1[:, None], b2[:, None], local)
    origins, directions = origins[:, 0], directions[:, 0]
    hit = prepared.plan.ray_scene.trace_closest(origins, directions)
    found = {"edges": float(weight @ passes_edges(prepared, part.moved, (start, origins, directions, hit), generator))}
    if part.complete:
        return found
    beyond = leaves_inside(origins, directions, part.inner, city) & (hit < 0)
    slope = directions[:, 2] / np.maximum(np.hypot(directions[:, 0], directions[:, 1]), 1e-12)
    far = (hit >= 0) & (scene.halo[hit] == FAR)
    return found | {
        "sky": float(weight @ (beyond & (slope > 0) & (slope <= RISE))),
        "reflected": float(weight @ (far | (beyond & (slope <= 0)))),
    }


def passes_edges(prepared, moved, rays, generator):
    """Whether rays, turned by the width of the sun's disc, newly meet one of some triangles or no longer do: (m,) bool.

    Parameters
    ----------
    moved : (t,) bool
    rays : tuple of (m,) int, (m, 3) float32, (m, 3) float32 and (m,) int
        Patches that they start from, origins, directions and hits.
    generator : numpy.random.Generator
    """
    start, origins, directions, hit = rays
    aside = np.cross(directions, generator.normal(size=directions.shape))
    aside /= np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-12)
    turned = (directions + WIDTH * aside).astype(np.float32)
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    other = prepared.plan.ray_scene.trace_closest(origins, turned)
    in_front = np.einsum("ij,ij->i", turned, prepared.patches.normal[start]) > 0
    meets = (np.append(moved, False)[one] for one in (hit, other))  # -1, no hit, takes the last
    return in_front & ((hit < 0) != (other < 0)) & np.logical_or(*meets)


def leaves_inside(origins, directions, inner, city):
    """Whether rays are still above the city where they leave a box around their origins: (m,) bool."""
    with np.errstate(divide="ignore", invalid="ignore"):
        edges = np.where(directions[:, :2] > 0, inner[1], inner[0])
        steps = (edges - origins[:, :2]) / directions[:, :2]
    steps = np.where(np.isfinite(steps), steps, np.inf).min(axis=1)
    with np.errstate(invalid="ignore"):
        places = origins[:, :2] + steps[:, None] * directions[:, :2]
    return ((places > city[0]) & (places < city[1])).all(axis=1)


def bound_hours(shares, albedo, weather, sky, irradiation):
    """What the surroundings leave out, in percent of the irradiation of the eligible surfaces.

    Reflected light is at most that of a face turned to the sun, DNI + DHI, after all reflections, times its albedo;
    beside edges, which may hide it or not, light itself is wrong.

    Parameters
    ----------
    shares : dict
        Of `measure_halo`.
    albedo : float
        The brightest.
    weather : Weather
    sky : str
        Model of the sky.
    irradiation : float
        Mean of the eligible surfaces over all intervals [Wm⁻²].

    Returns
    -------
    float or None
        None where no bound exists: a face that reflects all light, and something left out.
    """
    if not any(shares.values()):
        return 0.0
    if albedo >= 1 or not irradiation > 0:
        return None
    parts, data = split_sky(weather, sky), weather.data
    low = float(np.mean(parts.dome))
    low += sum(SOURCES[name].low * max(float(np.mean(light)), 0.0) for name, light in parts.sources.items())
    brightest = float((data["dni"] + data["dhi"]).mean())
    lost = shares["sky"] * low + (shares["reflected"] * albedo + shares["edges"]) * brightest
    return 100 * lost / (1 - albedo) / irradiation
