"""Products of the matrix of form factors with light."""

import numpy as np

from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.threads import map_in_order
from .form_factor_loops import (
    add_columns,
    add_elements,
    add_patches,
    add_single,
    add_steps,
    add_visible,
    link_patches,
)
from .form_factors import REPLICATE_BITS


def multiply(form_factors, factor, light, threads=1, *, out=None, total=None):
    """F · (factor ∘ light), the mean over the replicates.

    Parameters
    ----------
    form_factors : FormFactors
    factor : (p, cells) float32
        Radiosity of the cells per irradiance of their patch.
    light : (p, s) float32
        Irradiance of the patches by s light sources.
    threads : int
    out : (p, s) float32, optional
        Array to write to. Must not be `light`.
    total : (p, s) float32, optional
        The product is added to it instead of being returned by itself. Must not be `light`.

    Returns
    -------
    (p, s) float32
        The product, or `total` if given.
    """
    if light.shape[1] == 1:
        product = run_rows(form_factors, 1, threads, add_single, factor.ravel(), light[:, 0])
        return product if total is None else np.add(total, product, out=total)
    fresh = total is None
    product = total if total is not None else np.empty_like(light) if out is None else out
    if fresh:
        clear_unsent(form_factors, product)
    links = links_of(form_factors, factor, threads)

    def work(part):
        rows, linked = part
        add_patches(rows.chosen, linked, product, light, not fresh)

    for _ in map_in_order(work, zip(form_factors.rows, links, strict=True), threads):
        pass
    return product


def links_of(form_factors, factor, threads=1):
    """Patches that each row meets, with weights, for `add_patches`: list of tuples, of `link_patches`.

    They are kept with the form factors, since all reflections of all lights take the same factor.
    """
    if form_factors.links is None or form_factors.links[0] is not factor:
        flat = factor.ravel()
        linked = map_in_order(
            lambda rows: link_patches(*loop_inputs(form_factors, rows), flat), form_factors.rows, threads
        )
        form_factors.links = factor, list(linked)
    return form_factors.links[1]


def multiply_elements(form_factors, factor, light, threads=1):
    """F · (factor ∘ light), where light or factor differs between the cells of a patch.

    Parameters
    ----------
    factor : (p,) float32
    light : (p, cells) or (p, 1) float32
        Of cells or of whole patches. Factor times light is the radiosity.

    Returns
    -------
    (p, HEMISPHERE_REPLICATES) float32
        Replicates separately.
    """
    radiosity = radiosity_of_cells(form_factors, factor, light)
    product = run_rows(form_factors, HEMISPHERE_REPLICATES, threads, add_elements, radiosity, 0)
    return product * np.float32(HEMISPHERE_REPLICATES)


def multiply_steps(form_factors, factor, light, threads=1):
    """The same for three kinds of light of cells at once, the first two by replicate.

    Parameters
    ----------
    factor : (p,) float32
    light : (p, cells, 3) float32
        Overwritten with the radiosity.

    Returns
    -------
    two (p, HEMISPHERE_REPLICATES) float32
        F · (factor ∘ light) of the first and of the second, replicates separately.
    (p, 2) float32
        That of the second and of the third, the mean over the replicates.
    """
    light *= factor[:, None, None]
    product = run_rows(form_factors, 2 * HEMISPHERE_REPLICATES + 1, threads, add_steps, light.reshape(-1, 3))
    first, second, third = np.split(product, [HEMISPHERE_REPLICATES, 2 * HEMISPHERE_REPLICATES], axis=1)
    both = np.concatenate([second.sum(axis=1, keepdims=True), third], axis=1)
    return *(part * np.float32(HEMISPHERE_REPLICATES) for part in (first, second)), both


def multiply_starts(form_factors, factor, light, threads=1):
    """F · (factor ∘ light) by the cells in which rays start.

    Parameters
    ----------
    factor, light
        As in `multiply_elements`.

    Returns
    -------
    (p, starts) float32
        Their sum is the light of the patch.
    """
    radiosity = radiosity_of_cells(form_factors, factor, light)
    return run_rows(form_factors, form_factors.starts, threads, add_elements, radiosity, REPLICATE_BITS)


def radiosity_of_cells(form_factors, factor, light):
    """Factor (p,) times light (p, cells) or (p, 1), of each cell: (p · cells,) float32."""
    return np.broadcast_to(factor[:, None] * light, (len(factor), form_factors.cells)).ravel()


def multiply_visible(form_factors, patches, suns, threads=1):
    """F · (albedo ∘ visible share · cos(aoi)), where the visible share of an element is that of the point for it.

    Parameters
    ----------
    patches : tuple of (p,) float32, (p, 3) float32 and (p, elements) uint
        Albedo, normal, and the point that stands for each element.
    suns : tuple of (s, 3) float32 and (p, words, s) uint16
        Directions; and bit k of word w set where the sun is visible from point 16 w + k, so none for a sun behind.
    threads : int

    Returns
    -------
    (p, s) float32
    """
    directions, visible = suns
    suns = np.ascontiguousarray(directions.T), visible
    return run_rows(form_factors, visible.shape[2], threads, add_visible, patches, suns)


def multiply_columns(form_factors, factor, light, threads=1):
    """F · (factor ∘ light), the mean over the replicates, for light of cells that differs between the replicates.

    Parameters
    ----------
    factor : (p,) float32
    light : (p, cells, HEMISPHERE_REPLICATES) float32 or int16

    Returns
    -------
    (p, HEMISPHERE_REPLICATES) float32
    """
    places = light.reshape(-1, HEMISPHERE_REPLICATES)
    return run_rows(form_factors, HEMISPHERE_REPLICATES, threads, add_columns, factor, places)


def run_rows(form_factors, columns, threads, loop, *arrays):
    """Run a loop over all rows: its product, (p, columns) float32."""
    product = np.empty((form_factors.count, columns), np.float32)
    clear_unsent(form_factors, product)

    def work(rows):
        loop(*loop_inputs(form_factors, rows), product, *arrays)

    for _ in map_in_order(work, form_factors.rows, threads):
        pass
    return product


def clear_unsent(form_factors, product):
    """Set the product of patches that sent no rays to 0."""
    without = np.ones(len(product), bool)
    for rows in form_factors.rows:
        without[rows.chosen] = False
    product[without] = 0


def loop_inputs(form_factors, rows):
    """`rows` and `scale` of the compiled loops."""
    to_cell = np.int32(form_factors.start_bits)  # shifts a key to the cell that was hit
    to_patch = np.int32(to_cell + form_factors.cells.bit_length() - 1)
    share = np.float32(1 / (HEMISPHERE_REPLICATES * rows.rays))
    return (rows.chosen, rows.start, rows.key), (to_patch, to_cell, share)
