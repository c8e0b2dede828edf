"""Trace one tile, as a task that reads all it needs from disk and leaves its result there.

It also measures, by rays from the tile's own surfaces, what its surroundings leave out at most. No
sun below 2° is traced, so that direct sunlight misses nothing. A ray from an eligible surface that
leaves the surroundings less than 2° above the level may have met something that was left out:
skylight is lost. One that leaves downwards, or that meets the far surroundings, finds light that
may be wrong in either way, by no more than it can be.
"""

import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..city.scene import Halo, Scene
from ..effects.effect import TracePlan
from ..energy.pv_system import build_system
from ..light.prepare_scene import prepare_scene
from ..rays.ray_scene import HitPlaces
from ..rays.sample_points import cosine_direction
from ..results.transfer_file import write_transfer
from ..results.write_summary import finite, peak_memory
from ..settings.progress import silent
from ..settings.request import Request
from ..sky.horizon_band import SOURCES
from ..sky.sky_models import split_sky
from ..sun.suns import Suns
from ..weather.weather import Weather
from .run_tasks import finish_task, read_task, read_told
from .study import measure_sun_sampling, trace_scene
from .thin_surroundings import thin_surroundings
from .tiles import RISE

SHARES = ("sky", "reflected")  # what `_measure_halo` measures


@dataclass
class Run:
    """What all tiles of a run have in common."""

    request: Request  # in which the plan's decisions are settled
    suns: Suns
    weather: Weather
    city: tuple  # bounds of the whole scene in plan, two (2,) float64 [m]
    terrain: TracePlan  # of the distant terrain alone, decided for the whole


@dataclass
class Part:
    """What a tile needs beside it."""

    scene: Scene
    own: np.ndarray  # (m,) int, surfaces of the scene that the tile reports
    materials: list  # of patches.read_albedo.Found: each surface and, last, the generated ground
    inner: tuple  # bounds of the tile with its near surroundings in plan, two (2,) float64 [m]
    complete: bool  # whether nothing of the whole is left out
    measure: bool  # whether the error of sun sampling is measured here


def trace_part(run_path, part_path, result_path, threads):
    """Trace a tile, write its Transfer and figures, and delete its Part.

    Parameters
    ----------
    run_path, part_path : str
        Run and Part, of `write_task`.
    result_path : str
        File of the Transfer; its figures lie beside it, as of `finish_task`.
    threads : int or None

    Returns
    -------
    str
        `result_path`.
    """
    # A tile that is finished is not traced again.
    if read_told(Path(result_path)) is not None:
        return result_path
    started = time.monotonic(), time.process_time()
    # What the whole city decided, on horizon and suns, holds for the tile as well.
    run, part = read_task(run_path), read_task(part_path)
    request, scene = replace(run.request, threads=threads), part.scene
    prepared = prepare_scene(scene, request, suns=run.suns, materials=part.materials)
    terrain = run.terrain
    effects = [
        terrain[effect.key] if effect.key == "terrain-horizon" else effect
        for effect in prepared.plan.effects
    ]
    plan = replace(
        prepared.plan, effects=effects, terrain=terrain.terrain, hidden_suns=terrain.hidden_suns
    )
    rules = build_system(request).layout
    prepared = replace(prepared, plan=plan, rules=rules).build_tree(request)
    # How much light the cut of the tile may get wrong is measured by rays; then surroundings far
    # from the tile are thinned.
    halo = _measure_halo(prepared, request.seed, part, run.city)
    few = thin_surroundings(scene, prepared, part.own)
    triangles = len(scene.triangles), int(scene.own.sum())
    del scene, prepared, plan
    # Light of the tile, and what the choice of suns does to it, if this tile measures it.
    transfer = trace_scene(
        few.scene, run.weather, request, silent, Path(result_path).parent, prepared=few.prepared
    )
    sampling = None
    if part.measure:
        sampling = measure_sun_sampling(
            few.scene, run.weather, transfer, request, prepared=few.prepared
        )
    # Only the tile's own surfaces are written; figures beside them.
    own = np.searchsorted(few.surfaces, part.own)
    surfaces = few.scene.surfaces
    told = {
        "triangles": triangles[0],
        "own_triangles": triangles[1],
        "patches": len(few.prepared.patches),
        "seconds": time.monotonic() - started[0],
        "processor_seconds": time.process_time() - started[1],
        "peak_memory_bytes": peak_memory(),
        "halo": halo,
        "sun_sampling": sampling,
        "area": float(surfaces.area[surfaces.eligible].sum()),  # [m²]
    }
    finish_task(
        Path(result_path), lambda path: write_transfer(path, transfer.take(own)), finite(told)
    )
    Path(part_path).unlink(missing_ok=True)
    return result_path


def _measure_halo(prepared, seed, part, city, *, rays=8192):
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
        `sky`, of the sky lower than 2°; `reflected`, of what reflects; cosine-weighted means over
        the eligible area. Empty without an eligible surface, or where nothing is left out.
    """
    # Rays are drawn evenly over the eligible area, by the cosine of their direction.
    patches, scene = prepared.patches, prepared.scene
    # -1: the ground
    eligible = np.append(scene.surfaces.eligible, False)[scene.triangle_surface] & patches.receives
    area = np.where(eligible, patches.area, 0.0)
    if part.complete or not area.any():
        return {}
    generator = np.random.default_rng([seed, 0x7E1E])
    start = generator.choice(len(area), rays, p=area / area.sum())
    b1, b2, *angles = generator.random((4, rays), np.float32)
    # fold the square into the triangle
    b1, b2 = (np.where(b1 + b2 > 1, 1 - one, one) for one in (b1, b2))
    places = HitPlaces(start, b1, b2)
    origins, directions = patches.leave(places, cosine_direction(*angles))
    hit = prepared.plan.ray_scene.trace_closest(origins, directions)
    # Rays that are still above the city where they leave the box.
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = (
            np.where(directions[:, :2] > 0, part.inner[1], part.inner[0]) - origins[:, :2]
        ) / directions[:, :2]
        steps = np.where(np.isfinite(steps), steps, np.inf).min(axis=1)
        places = origins[:, :2] + steps[:, None] * directions[:, :2]
    # Beyond: nothing of the tile was met, and the whole city goes on there; far: a thinned piece
    # was.
    beyond = ((places > city[0]) & (places < city[1])).all(axis=1) & (hit < 0)
    slope = directions[:, 2] / np.maximum(np.hypot(directions[:, 0], directions[:, 1]), 1e-12)
    far = (hit >= 0) & (scene.halo[hit] == Halo.FAR)
    return {
        "sky": float(np.mean(beyond & (slope > 0) & (slope <= RISE))),
        "reflected": float(np.mean(far | (beyond & (slope <= 0)))),
    }


def bound_hours(shares, albedo, weather, sky, irradiation):
    """What the surroundings leave out, in percent of the irradiation of the eligible surfaces.

    Reflected light is at most what a face turned to the sun sends on: its albedo times DNI + DHI,
    after all reflections.

    Parameters
    ----------
    shares : dict
        Of `_measure_halo`.
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
    # Irradiance that the low sky could bring, and radiosity that the brightest face could have.
    low = float(np.mean(parts.dome))
    low += sum(
        SOURCES[name].low * max(float(np.mean(light)), 0.0) for name, light in parts.sources.items()
    )
    brightest = float((data["dni"] + data["dhi"]).mean())
    # Left out at first sight, and by all further reflections: a geometric series.
    lost = shares["sky"] * low + shares["reflected"] * albedo * brightest
    return 100 * lost / (1 - albedo) / irradiation
