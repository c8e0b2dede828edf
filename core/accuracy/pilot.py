"""A pilot: a part of the user's own scene traced with few settings, which shows what rays and accuracy cost there.

    whole city as obstacles ─► patches of a square in its middle ─► A  256 rays, 16 shadow points, all reflections
                                                                   C   64 rays,  4 shadow points, 1 reflection
    patches drawn from the whole city ─► A, C and, between them, B: 64 rays, 16 shadow points; all of them timed
    rays: how much ground they meet (`survey`)

Errors of A and C by source show how fast each falls. Light is passed on from neighbour to neighbour, so they need whole
neighbourhoods: errors are those of the surfaces in the inner half of the square, for what lies around the square sends
no light, which makes the surfaces at its edge too dark and what they see too uneven. Seconds need what is typical of
the city: see `time_patches`.
"""

from dataclasses import dataclass

import numpy as np

from ..settings.progress import silent
from ..sun.choose_suns import choose_suns
from ..sun.spread_suns import spread_suns
from .pilot_run import RUNS, SUNS, trace_part
from .survey import survey_city
from .time_electricity import time_electricity
from .time_patches import time_patches

PATCHES, INNER = 4_000, 2_000  # of the square, and of its inner part
SQUARE = ("A", "C")  # of which errors are told


@dataclass
class Pilot:
    """What the runs showed."""

    runs: dict  # "A" and "C" -> PilotRun, of the square
    timed: list  # of PilotRun, of patches of the whole city
    empty: tuple  # of PilotRun, of hardly a patch: in arrays of few rows, and of many
    survey: object  # Survey of the whole city
    electricity: float  # [s] for all surfaces
    transfer: object  # Transfer of run A


def run_pilot(scene, prepared, weather, request, progress=silent):
    """Trace the pilot.

    Parameters
    ----------
    scene : Scene
    prepared : PreparedScene
        With its tree.
    weather : Weather
    request : Request
    progress : callable

    Returns
    -------
    Pilot
    """
    suns = spread_suns(choose_suns(SUNS, *weather.axis, request.seed, position=weather.data))
    inputs = scene, prepared, weather, request, suns
    square, counted = choose_neighbourhood(prepared, PATCHES, INNER)
    runs, transfers = {}, {}
    for done, name in enumerate(SQUARE):  # the first loads compiled code, so that neither is timed
        progress("pilot", done, len(SQUARE), "runs")
        runs[name], transfers[name] = trace_part(inputs, square, RUNS[name], counted)
    progress("pilot", len(SQUARE), len(SQUARE), "runs")
    empty, timed = time_patches(inputs, runs["A"])
    return Pilot(
        runs=runs,
        timed=timed,
        empty=empty,
        survey=survey_city(prepared, request),
        electricity=time_electricity(transfers["A"], weather, request),
        transfer=transfers["A"],
    )


def choose_neighbourhood(prepared, patches, inner):
    """Patches of a square in the middle of the city, (p,) bool, and surfaces in its inner part, (n,) bool.

    Both are the whole city where that has no more patches than the square. Where no eligible surface lies in the inner
    part, as where the middle of a city is one large roof, those of the whole square count.
    """
    scene, traced = prepared.scene, prepared.patches.receives & ~prepared.plan.unobstructed
    square = choose_square(scene, prepared.patches, traced, patches)
    within = square if square.all() else choose_square(scene, prepared.patches, traced, inner)
    counted = surfaces_of(scene, within)
    return square, counted if (counted & scene.surfaces.eligible).any() else surfaces_of(scene, square)


def surfaces_of(scene, patches):
    """Surfaces of some patches: (n,) bool."""
    found, own = np.zeros(len(scene.surfaces), bool), scene.triangle_surface
    found[own[patches & (own >= 0)]] = True
    return found


def choose_square(scene, patches, traced, count):
    """Patches of surfaces and ground in a square that has about so many traced ones: (p,) bool.

    Its middle is the median of the eligible patches.
    """
    own = scene.triangle_surface
    corners = np.asarray(scene.vertices, float)[scene.triangles].mean(axis=1)[:, :2]
    eligible = np.append(scene.surfaces.eligible, False)[own]
    middle = np.median(corners[eligible if eligible.any() else traced], axis=0) if traced.any() else corners[:1].mean(0)
    away = np.abs(corners - middle).max(axis=1)
    # A surface lies where its patches do on average, and is taken as a whole.
    surfaces = len(scene.surfaces)
    area = np.bincount(own[own >= 0], patches.area[own >= 0], surfaces)
    mean = np.bincount(own[own >= 0], (patches.area * away)[own >= 0], surfaces) / np.maximum(area, 1e-12)
    distance = np.where(own >= 0, np.append(mean, 0)[own], away)
    if traced.sum() <= count:
        return np.ones(len(own), bool)
    return distance <= np.sort(distance[traced])[count - 1]
