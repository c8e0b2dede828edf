"""Trace one tile, as a task that reads all it needs from disk and leaves its result there."""

import json
import pickle
import time
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..light.prepare_scene import build_tree, prepare_scene
from ..progress import silent
from ..results.write_summary import finite, peak_memory
from ..results.write_transfer import write_transfer
from ..scene.scene import OWN, Scene
from ..study import measure_sun_sampling, trace_scene
from ..sun.suns import Suns
from .bound_halo import measure_halo
from .take_part import take_rows
from .thin_surroundings import thin_surroundings


@dataclass
class Run:
    """What all tiles of a run have in common."""

    request: Any  # Request, in which the plan's decisions are settled
    suns: Suns
    weather: Any  # Weather
    city: tuple  # bounds of the whole scene in plan, two (2,) float64 [m]
    terrain: Any = None  # Effect of distant terrain, decided for the whole


@dataclass
class Part:
    """What a tile needs beside it."""

    scene: Scene
    own: np.ndarray  # (m,) int, surfaces of the scene that the tile reports
    materials: list  # of materials.read_albedo.Found: each surface and, last, the generated ground
    moved: np.ndarray  # (t,) bool, triangles of the scene that were made coarser
    inner: tuple  # bounds of the tile with its near surroundings in plan, two (2,) float64 [m]
    complete: bool  # whether nothing of the whole is left out
    measure: bool  # whether the error of sun sampling is measured here


def trace_part(run_path, part_path, result_path, threads):
    """Trace a tile and write its Transfer and figures.

    Parameters
    ----------
    run_path, part_path : str
        Pickled Run and Part.
    result_path : str
        File of the Transfer; its figures lie beside it, and are there only when all is written.
    threads : int or None

    Returns
    -------
    str
        `result_path`.
    """
    figures = Path(result_path).with_suffix(".json")
    if figures.exists():
        return result_path
    started = time.monotonic(), time.process_time()
    run, part = (pickle.loads(Path(path).read_bytes()) for path in (run_path, part_path))
    request, scene = replace(run.request, threads=threads), part.scene
    prepared = prepare_scene(scene, request, suns=run.suns, materials=part.materials)
    effects = [run.terrain if one.key == run.terrain.key else one for one in prepared.plan.effects]
    prepared = build_tree(replace(prepared, plan=replace(prepared.plan, effects=effects)), request)
    halo = measure_halo(prepared, request.seed, part, run.city)
    few = thin_surroundings(scene, prepared, part.own)
    triangles = len(scene.triangles), int((scene.halo == OWN).sum())
    del scene, prepared
    transfer = trace_scene(few.scene, run.weather, request, silent, Path(result_path).parent, prepared=few.prepared)
    sampling = None
    if part.measure:
        sampling = measure_sun_sampling(few.scene, run.weather, transfer, request, prepared=few.prepared)
    own = np.searchsorted(few.surfaces, part.own)
    write_whole(Path(result_path), lambda path: write_transfer(path, keep_own(transfer, own)))
    told = {
        "triangles": triangles[0],
        "own_triangles": triangles[1],
        "patches": len(few.prepared.patches),
        "seconds": time.monotonic() - started[0],
        "processor_seconds": time.process_time() - started[1],
        "peak_memory_bytes": peak_memory(),
        "halo": halo,
        "sun_sampling": sampling,
        "areas": eligible_areas(few.scene.surfaces),
    }
    write_whole(figures, lambda path: path.write_text(json.dumps(finite(told)), encoding="utf-8"))
    Path(part_path).unlink(missing_ok=True)
    return result_path


def write_whole(path, write):
    """Write a file completely or not at all."""
    unfinished = path.with_name(f"{path.name}.{time.monotonic_ns()}")
    try:
        write(unfinished)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def keep_own(value, own):
    """A Transfer with some of its surfaces only: each of its columns, however deep."""
    count = len(value.surfaces)
    return replace(value, **{one.name: keep_column(getattr(value, one.name), own, count) for one in fields(value)})


def keep_column(value, own, count):
    """Some rows of what has one for each of the surfaces; anything else as it is."""
    if hasattr(value, "surfaces"):  # the same scene with bare trees
        return keep_own(value, own)
    if hasattr(value, "direction") or hasattr(value, "elevation"):  # of suns, and of distant terrain
        return value
    if isinstance(value, dict):
        return {name: keep_column(column, own, count) for name, column in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        columns = {one.name: getattr(value, one.name) for one in fields(value)}
        if not any(isinstance(column, np.ndarray) for column in columns.values()):
            return value
        return replace(value, **{name: keep_column(column, own, count) for name, column in columns.items()})
    return take_rows(value, own) if isinstance(value, np.ndarray | list) and len(value) == count else value


def eligible_areas(surfaces):
    """Eligible area of each kind and orientation: dict of float [m²]."""
    names = [" ".join(pair) for pair in zip(surfaces.kind, surfaces.orientation, strict=True)]
    found = {}
    for name, area, eligible in zip(names, surfaces.area.tolist(), surfaces.eligible.tolist(), strict=True):
        if eligible:
            found[name] = found.get(name, 0.0) + area
    return found
