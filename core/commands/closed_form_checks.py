"""Closed forms against the tracer: tilted faces, a street canyon, a furnace, view factors, a
module's temperature.
"""

from functools import cache, partial

import numpy as np
from pvlib.temperature import sapm_cell

from ..energy.pv_system import MOUNTINGS
from ..light.bare_light import trace_bare
from ..light.trace_gather import trace_gather
from ..settings.progress import silent
from ..settings.request import Request
from ..sun.suns import Suns
from .plain_scenes import join_parts, rectangle, room

SINGLE = 1e-6  # rounding in single precision of a number near 1

# Infinite street canyon, height = width, after 0, 1, 2, 3 reflections: mean of a wall and of the
# street per isotropic sky. The first is exact (crossed strings), the others come from a numeric
# radiosity of 80 strips per face.
CANYON = {
    "wall": (0.2928932, 0.353350, 0.362375, 0.363992),
    "street": (0.4142136, 0.451931, 0.461190, 0.462563),
}

# Between opposite rectangles (Howell C-11) and squares at a right angle (C-14); Helios names the
# second in its test.
SQUARE = rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0])
VIEW_FACTORS = (
    (
        "parallel unit squares at distance 1",
        0.19982489569838738,
        SQUARE,
        ([0, 0, 1], [0, 1, 0], [1, 0, 0]),
    ),
    (
        "parallel rectangles of 1 by 2 at distance 0.5",
        0.5089886690414376,
        rectangle([0, 0, 0], [1, 0, 0], [0, 2, 0]),
        ([0, 0, 0.5], [0, 2, 0], [1, 0, 0]),
    ),
    (
        "unit squares at a right angle",
        0.20004377607540316,
        SQUARE,
        ([0, 0, 0], [0, 1, 0], [0, 0, 1]),
    ),
)


def closed_form_checks():
    """Checks of the light that is traced, and of cell temperature, against known values.

    Returns
    -------
    list of tuple
        Name, expected value, allowance for rounding, and a function that finds value and standard
        error when it is called.
    """
    checks = []
    # A plane in the open sees its share of sky and ground.
    for tilt in (0, 30, 60, 90, 105):
        cosine = np.cos(np.radians(tilt))
        expected = (1 + cosine) / 2 + 0.25 * (1 - cosine) / 2  # Eq. 9
        for words, rays in (("closed form", False), ("by rays", True)):
            checks.append(
                (
                    f"unshaded face at {tilt}°, {words}",
                    expected,
                    SINGLE,
                    partial(_unshaded, tilt, rays),
                )
            )
    # An infinite street canyon, known after each reflection.
    for face, known in CANYON.items():
        for bounces, expected in enumerate(known):
            name = f"street canyon, {face} after {bounces} reflections"
            checks.append(
                (name, expected, SINGLE, lambda face=face, bounces=bounces: _canyon(bounces)[face])
            )
    # A closed room that shines by itself: the sum of a geometric series.
    for albedo, bounces in ((0.25, 3), (0.999, 50), (1.0, 50)):
        expected = bounces + 1.0 if albedo == 1 else (1 - albedo ** (bounces + 1)) / (1 - albedo)
        name = f"closed furnace, albedo {albedo:g}, {bounces} reflections"
        checks.append((name, expected, SINGLE * expected, partial(furnace, albedo, bounces)))
    # View factors of rectangles, and Sandia's cell temperature at one point.
    for name, expected, one, other in VIEW_FACTORS:
        checks.append(
            (f"view factor, {name}", expected, SINGLE, partial(_view, one, rectangle(*other)))
        )
    name, thermal = "cell temperature at 900 W/m², 20 °C, 5 m/s [°C]", MOUNTINGS["open-rack"]
    checks.append(
        (name, 40.291, 5e-4, lambda: (float(sapm_cell(900.0, 20.0, 5.0, **thermal)), 0.0))
    )
    return checks


def sun_at(*direction):
    """One sun in each of some directions."""
    directions = np.array(direction, float)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    place = np.arange(len(directions), dtype=np.int32)
    return Suns(
        "hourly", directions, np.full(len(place), 1 / len(place)), np.zeros_like(place), place
    )


def trace(scene, suns=None, **settings):
    """Transfer of a scene, by default under the sun at zenith."""
    return trace_gather(
        scene, sun_at([0, 0, 1]) if suns is None else suns, Request(**settings), silent
    )


def mean_of(transfer, chosen, name="diffuse_relative"):
    """Area-weighted mean of some surfaces, and its standard error."""
    share = transfer.surfaces.area[chosen] / transfer.surfaces.area[chosen].sum()
    error = share * transfer.diffuse_relative_standard_error[chosen]
    return float(share @ getattr(transfer, name)[chosen]), float(np.sqrt((error**2).sum()))


def _unshaded(tilt, rays):
    """A square that faces south, with nothing around it."""
    up = [0, np.cos(np.radians(tilt)), np.sin(np.radians(tilt))]
    scene = join_parts([rectangle([0, 0, 5], [1, 0, 0], up)])
    effects = {"sky-rays": True, "shadow-rays": True} if rays else {}
    return mean_of(trace(scene, samples=1 << 15, effects=effects), np.arange(2))


@cache
def _canyon(bounces, samples=8192, strips=40):
    """Mean of the middle of a long street's walls and of its ground, each with its standard error:
    dict.
    """
    parts = []
    for start, end in ((-100, -10), (-10, 10), (10, 100)):
        length = [end - start, 0, 0]
        parts.append(rectangle([start, 0, 0], length, [0, 1, 0], strips))
        parts.append(rectangle([start, 1, 0], length, [0, 0, 1], strips))
        parts.append(rectangle([start, 0, 1], length, [0, 0, -1], strips))
    transfer = trace(join_parts(parts), max_bounces=bounces, samples=samples, far_ground=False)
    wall, street = np.arange(8 * strips, 12 * strips), np.arange(6 * strips, 8 * strips)
    return {"wall": mean_of(transfer, wall), "street": mean_of(transfer, street)}


def furnace(albedo, bounces):
    """Irradiance inside a closed room whose faces all start with 1: (1 - ρⁿ⁺¹)/(1 - ρ) after n
    reflections.

    Returns
    -------
    float
        Of the face with the largest deviation from the mean.
    float
        0: there is no noise if every ray hits a face.
    """
    closed = trace_bare(join_parts(room((0, 0, 0), (4, 5, 3))), albedo, 1024, lit_inside=True)
    irradiance = closed.reflect(bounces)
    return float(irradiance[np.abs(irradiance - irradiance.mean()).argmax()]), 0.0


def _view(one, other):
    """View factor from one rectangle to another."""
    scene, own = join_parts([one, other]), len(one[1])
    shares, area = trace_bare(scene, 1, 1 << 16).view_of_others()
    shares, share = shares[:own], area[:own] / area[:own].sum()
    error = share**2 @ shares.var(axis=1, ddof=1) / shares.shape[1]
    return float(share @ shares.mean(axis=1)), float(np.sqrt(error))
