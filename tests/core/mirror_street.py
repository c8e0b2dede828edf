"""A facade and the street opposite, in strips: the light that a mirror throws there is known in
closed form.
"""

import itertools

import numpy as np
from scenes import join, run_forward, run_hybrid, strip, suns_towards

HEIGHT, HALF = 10.0, 400.0  # [m] of the facade, and half its length
EDGES = np.array([0.0, 4.0, 8.0, 12.0, 20.0])  # [m] from the facade, of strips of the street
MIDDLE = slice(10, 18)  # the street's surfaces in the middle: four strips of two triangles


def street():
    """A facade that looks south onto a street; only the middle of the street is looked at.

    Returns
    -------
    Scene
        Surfaces 0 and 1 are the facade.
    """
    parts = [strip([-HALF, 0, 0], [2 * HALF, 0, 0], [0, 0, HEIGHT], 1)]
    for start, end in ((-HALF, -HALF / 2), (-HALF / 2, HALF / 2), (HALF / 2, HALF)):
        for near, far in itertools.pairwise(EDGES):
            parts.append(strip([start, -far, 0], [end - start, 0, 0], [0, far - near, 0], 1))
    return join(parts)


def finish(tmp_path, text):
    """An albedo file."""
    path = tmp_path / "finish.csv"
    path.write_text(text)
    return str(path)


def trace_street(tmp_path, text, elevation, estimator="gather", **settings):
    """Transfer of the street with the finishes of a text, under one sun that stands before the
    facade.
    """
    angle = np.radians(elevation)
    run, rays = {
        "gather": (run_hybrid, {"samples": 1 << 17, "shadow_samples": 1 << 15}),
        "forward": (run_forward, {"samples": 25_000}),
    }[estimator]
    rays |= {"max_bounces": 1, "far_ground": False, "albedo_file": finish(tmp_path, text)}
    return run(street(), suns_towards([[0, -np.cos(angle), np.sin(angle)]]), **rays | settings)


def light_of_strips(transfer, column=None):
    """Mean and standard error of each strip: of diffuse light, or of what a sun reflects
    onto it.
    """
    area = transfer.surfaces.area[MIDDLE].reshape(4, 2)
    values = transfer.diffuse_relative if column is None else transfer.direct_reflected[:, column]
    error = (
        transfer.diffuse_relative_standard_error
        if column is None
        else transfer.direct_annual_standard_error
    )
    share = area / area.sum(axis=1, keepdims=True)
    mean = (share * values[MIDDLE].reshape(4, 2)).sum(axis=1)
    return mean, np.sqrt((share**2 * error[MIDDLE].reshape(4, 2) ** 2).sum(axis=1))


def lit_share(elevation):
    """Share of each strip onto which the mirror image of the sun shines: a beam as wide as the
    facade is high.
    """
    reach = HEIGHT / np.tan(np.radians(elevation))
    return np.clip((reach - EDGES[:-1]) / np.diff(EDGES), 0, 1)
