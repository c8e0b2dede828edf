"""Products of the matrix of form factors with light."""

import numpy as np

from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.threads import map_in_order
from .form_factor_loops import (
    add_columns,
    add_elements,
    add_patches,
    add_steps,
    add_visible,
    link_patches,
)
from .form_factors import REPLICATE_BITS


def multiply(form_factors, factor, light, threads=1):
    """F · (factor ∘ light), the mean over the replicates.

    Parameters
    ----------
    form_factors : FormFactors
    factor : (p, cells) float32
        Radiosity of the cells per irradiance of their patch.
    light : (p, s) float32 or float64
        Irradiance of the patches by s light sources.
    threads : int

    Returns
    -------
    (p, s) of the same type
    """
    # Links are kept with the form factors, since all reflections of all lights take the same
    # factor.
    if form_factors.links is None or form_factors.links[0] is not factor:
        flat = factor.ravel()
        links = [
            list(map_in_order(lambda part: (part[0][0], link_patches(*part, flat)), parts, threads))
            for parts in _inputs_of(form_factors)
        ]
        form_factors.links = factor, links
    return _run_loop(form_factors.links[1], np.zeros_like(light), threads, add_patches, light)


def multiply_elements(form_factors, radiosity, threads=1):
    """F times the radiosity of cells, (p, cells) float32: (p, HEMISPHERE_REPLICATES) float32,
    replicates separately.
    """
    product = _run_rows(
        form_factors, HEMISPHERE_REPLICATES, threads, add_elements, radiosity.ravel(), 0
    )
    return product * np.float32(HEMISPHERE_REPLICATES)


def multiply_starts(form_factors, radiosity, threads=1):
    """Multiply form factors and radiosity by the cells in which rays start: (p, starts) float32,
    whose sum is the light of the patch.
    """
    return _run_rows(
        form_factors,
        form_factors.start_elements,
        threads,
        add_elements,
        radiosity.ravel(),
        REPLICATE_BITS,
    )


def multiply_steps(form_factors, radiosity, threads=1):
    """F times three kinds of radiosity of cells at once, (p, cells, 3) float32.

    Returns
    -------
    two (p, HEMISPHERE_REPLICATES) float32
        Of the first and of the second, replicates separately.
    (p, 2) float32
        Of the second and of the third, the mean over the replicates.
    """
    product = _run_rows(
        form_factors, 2 * HEMISPHERE_REPLICATES + 1, threads, add_steps, radiosity.reshape(-1, 3)
    )
    first, second, third = np.split(
        product, [HEMISPHERE_REPLICATES, 2 * HEMISPHERE_REPLICATES], axis=1
    )
    both = np.concatenate([second.sum(axis=1, keepdims=True), third], axis=1)
    return *(part * np.float32(HEMISPHERE_REPLICATES) for part in (first, second)), both


def multiply_visible(form_factors, patches, suns, threads=1):
    """F · (albedo ∘ visible share · cos(aoi)), where an element's visible share is measured at its
    point.

    Parameters
    ----------
    patches : tuple of (p,) float32, (p, 3) float32 and (p, elements) uint
        Albedo, normal, and the point that stands for each element.
    suns : tuple of (s, 3) float32 and (p, words, s) uint16
        Directions; and bit k of word w set where the sun is visible from point 16 w + k, so none
        for a sun behind.
    threads : int

    Returns
    -------
    (p, s) float32
    """
    directions, visible = suns
    suns = np.ascontiguousarray(directions.T), visible
    return _run_rows(form_factors, visible.shape[2], threads, add_visible, patches, suns)


def multiply_columns(form_factors, factor, light, threads=1):
    """F · (factor ∘ light), the mean over the replicates, for light of cells that differs between
    the replicates.

    Parameters
    ----------
    factor : (p,) float32
    light : (p, cells, HEMISPHERE_REPLICATES) float32 or int16

    Returns
    -------
    (p, HEMISPHERE_REPLICATES) float32
    """
    places = light.reshape(-1, HEMISPHERE_REPLICATES)
    return _run_rows(form_factors, HEMISPHERE_REPLICATES, threads, add_columns, factor, places)


def _run_rows(form_factors, columns, threads, loop, *arrays):
    """Run a loop over all rows: its product, (p, columns) float32."""
    product = np.zeros((form_factors.count, columns), np.float32)
    return _run_loop(_inputs_of(form_factors), product, threads, loop, *arrays)


def _run_loop(rounds, product, threads, loop, *arrays):
    """Run a loop over the parts of each round, given by its first arguments: the product, to which
    it adds.
    """
    for parts in rounds:
        for _ in map_in_order(lambda part: loop(*part, product, *arrays), parts, threads):
            pass
    return product


def _inputs_of(form_factors):
    """`rows` and `scale` of the compiled loops: in each round a list of both."""
    scale = scales_of(form_factors)
    return [
        [((rows.chosen, rows.start, rows.key), scale) for rows in some]
        for some in form_factors.rounds
    ]


def scales_of(form_factors):
    """`scale` of the loops: shifts from a key to the patch and to the cell that was hit, and shares
    of rays.
    """
    to_cell = np.int32(form_factors.start_bits)
    return np.int32(to_cell + form_factors.elements.bit_length() - 1), to_cell, form_factors.share
