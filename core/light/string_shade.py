"""What modules in series lose when shade moves over them, at each traced sun.

A module is three blocks of cells, each with a bypass diode. Of the B blocks of a string N see no
sun. Either these are bypassed, or all blocks carry the current of the dark ones:

    f(d) = max(1 - N/B, d)        power over the unshaded string's, where diffuse and
                                  reflected light make the share d of all light
    m(d) = (1 - N/B) (1 - d) + d  the same, if each block gave all that its own light is worth
    m - f = min(N/B d, (1 - N/B)(1 - d))

The last line is what a string loses by being one: nothing where all of it is lit, or all dark. Its
mean over a surface's strings, at some d, is kept of each sun, and hours lie between suns and
between d. Means of N/B would not do: a string lit on one traced day and dark on the next loses
nothing on both, and nothing between.

References
----------
F. Martínez-Moreno, J. Muñoz, E. Lorenzo (2010), Experimental model to estimate shading losses on PV
arrays. :doi:`10.1016/j.solmat.2010.07.029`
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import njit

from ..city.city import number_names
from ..city.outline_triangles import outline_triangles
from ..city.racks import find_racked_roofs
from ..modules.lay_city import lay_city
from .measure_cover import list_clearances
from .shadow_points import WORD, shadow_points
from .taken_parts import find_taken

DIFFUSE_SHARES = (0.25, 0.5, 0.75)  # d at which losses are kept; at 0 and 1 there are none
LOSS_STEP = 0.25 / 255  # share of the full power; no string loses more than a quarter of it
BLOCKS = 3  # of a module, side by side along its short edge


def lay_traced(prepared, context, traced, cramped):
    """Modules on the surfaces of a city whose cover is known, kept with what is taken of surfaces
    in the GatherContext, where it is wanted what their strings lose.

    Parameters
    ----------
    prepared : PreparedScene
    context : GatherContext
    traced : Traced
    cramped : (p, k) uint64
        As of TracedCity.
    """
    if asks_for_strings(prepared, context):
        context.taken = find_taken(
            prepared.scene, context.patch_to_surface, traced.covered, cramped
        )
        context.layout = lay_carriers(prepared, context, find_carriers(context))


def asks_for_strings(prepared, context):
    """Whether modules lie in rows and shade moves over them, so that their strings are wanted."""
    return bool(prepared.rules and prepared.rules.rows and context.plan.string_shade)


def find_carriers(context):
    """Which surfaces may carry modules: (n,) bool; who counts them later may leave some out."""
    surfaces = context.surfaces
    carries = np.asarray(surfaces.eligible) | (np.asarray(surfaces.kind) == "flat")
    carries &= ~find_racked_roofs(surfaces.surface_id, surfaces.kind)
    carries &= _hidden_share(context) <= 0.5
    # Of those around a tile some patches are missing.
    own = context.owner >= 0
    area = np.bincount(context.owner[own], context.patches.area[own], len(surfaces))
    return carries & (area > 0.999 * np.asarray(surfaces.area))


def _hidden_share(context):
    """Share of surfaces that is covered or has no room at the clearance of the run: (n,)."""
    covered_share, no_room, _ = context.taken
    column = list_clearances(context.request).index(context.request.clearance)
    return covered_share + no_room[:, column]


def lay_carriers(prepared, context, carries):
    """Modules on some surfaces, (n,) bool: ModuleLayout.

    Parameters
    ----------
    prepared : PreparedScene
    context : GatherContext
        With what is taken of surfaces.
    carries : (n,) bool
        Some of `find_carriers`; of polygons that were cut all or none.
    """
    scene, surfaces = prepared.scene, context.surfaces
    # Outlines of all surfaces of their buildings, as storeys begin at the lowest of these.
    building = number_names([str(name) for name in surfaces.building_id])
    wanted = np.isin(building, building[carries])
    number = np.where(np.append(wanted, False)[scene.triangle_surface], scene.triangle_surface, -1)
    outlines = outline_triangles(replace(scene, triangle_surface=number))
    column = list_clearances(context.request).index(context.request.clearance)
    how = {"hidden": _hidden_share(context), "taken": context.taken[2][:, column]}
    return lay_city(surfaces, outlines, carries, prepared.rules, **how)[0]


class StringTable(NamedTuple):
    """Which shadow points stand for the blocks of q strings."""

    surface: np.ndarray  # (q,) int64, ascending
    blocks: np.ndarray  # (q,) float32, B
    weight: np.ndarray  # (q,) float32, share of the string in its surface, by blocks
    start: np.ndarray  # (q + 1,) int64, first entry of each string
    # of each entry, a point: its patch and number there, and the blocks that it stands for
    patch: np.ndarray  # (e,) int64
    point: np.ndarray  # (e,) int64
    count: np.ndarray  # (e,) float32


def empty_losses(shape):
    """Room for `add_losses`, of some surfaces and suns, without losses."""
    return np.zeros((*shape, len(DIFFUSE_SHARES)), np.uint8)


def number_strings(layout, facade, *, rows_of_roof=3, longest=20.0):
    """String that each of m modules belongs to, numbered through by surface: (m,) int64.

    A string is one storey of a facade, or some rows of anything else, and not too long.

    Parameters
    ----------
    layout : ModuleLayout
        Whose rows are storeys on facades.
    facade : (n,) bool
        Which surfaces are facades.
    rows_of_roof : int
    longest : float
        [m]
    """
    row = np.where(np.asarray(facade)[layout.surface], layout.row, layout.row // rows_of_roof)
    groups, own = np.unique(_number_pairs(layout.surface, row), return_inverse=True)
    # Where modules begin and end along their row; each group is cut into pieces of equal length.
    length = np.linalg.norm(layout.along, axis=1)
    place = np.einsum("ij,ij->i", layout.corner, layout.along / length[:, None])
    begin, end = np.full((2, len(groups)), np.inf) * [[1], [-1]]
    np.minimum.at(begin, own, place)
    np.maximum.at(end, own, place + length)
    extent = (end - begin)[own]
    pieces = np.ceil(extent / longest - 1e-3)
    piece = np.floor((place + length / 2 - begin[own]) / extent * pieces).astype(int)
    return np.unique(_number_pairs(own, piece), return_inverse=True)[1]


def _number_pairs(first, second):
    """One number for each pair of two, (k,) int64, in the order of pairs."""
    return first * (int(second.max(initial=0)) + 1) + second


def middles_of_blocks(layout):
    """Middles of the blocks of m modules: (m, BLOCKS, 3) float64 [m]."""
    along, up = layout.along, layout.up
    upright = np.linalg.norm(up, axis=1) >= np.linalg.norm(along, axis=1)
    short = np.where(upright[:, None], along, up)
    middle = layout.corner + (along + up) / 2
    steps = (np.arange(BLOCKS) + 0.5) / BLOCKS - 0.5
    return middle[:, None] + steps[:, None] * short[:, None]


def table_of_strings(context, watch):
    """Points that stand for the blocks of strings: the nearest one of the same surface that lies in
    the open and at which light counts.

    Parameters
    ----------
    context : GatherContext
        With its layout.
    watch : SunWatch
        Whose points are known.

    Returns
    -------
    StringTable
        Without blocks on surfaces that have no point in the open, and without strings that nothing
        shades.
    """
    # Patches of surfaces with modules, one surface after the other, and their points in the open.
    layout, owner = context.layout, context.owner
    surface, middles = layout.surface, middles_of_blocks(layout)
    string = number_strings(layout, np.asarray(context.surfaces.kind) == "facade")
    wanted = np.zeros(int(owner.max(initial=-1)) + 2, bool)  # the last one: no surface
    wanted[surface] = True
    rows = np.flatnonzero(wanted[owner] & (watch.traced | watch.unobstructed))
    rows = rows[np.argsort(owner[rows], kind="stable")]
    positions = shadow_points(watch.patches, rows, watch.point_count)
    usable = watch.points.open_points[rows] & ~watch.points.find_dark(rows)
    bounds = np.searchsorted(owner[rows], np.stack([surface, surface + 1]))
    nearest = np.full((len(surface), BLOCKS), -1)
    _find_nearest(middles.astype(np.float32), bounds, positions, usable, nearest)
    # Blocks of a string with the same point are one entry.
    place, own = nearest.ravel(), np.repeat(string, BLOCKS)
    pairs = (own * positions[..., 0].size + place)[place >= 0]
    pairs, count = np.unique(pairs, return_counts=True)
    string_of_entry, place = np.divmod(pairs, max(positions[..., 0].size, 1))
    patch, point = rows[place // watch.point_count], place % watch.point_count
    # Strings on points from which every sun is visible lose nothing.
    shaded = np.bincount(string_of_entry, watch.traced[patch], string.max(initial=-1) + 1) > 0
    blocks = np.bincount(string_of_entry, count, len(shaded))
    surface_of_string = np.zeros(len(shaded), np.int64)
    surface_of_string[string] = surface
    whole = np.bincount(surface_of_string, blocks)[surface_of_string]
    kept, taken = np.flatnonzero(shaded), shaded[string_of_entry]
    # Of each string its surface, its blocks, their share of all blocks of that surface, and where
    # its entries begin; of each entry the patch, the point and how many blocks it stands for.
    return StringTable(
        surface_of_string[kept],
        blocks[kept].astype(np.float32),
        (blocks[kept] / whole[kept]).astype(np.float32),
        np.searchsorted(string_of_entry[taken], [*kept, len(shaded)]),
        patch[taken],
        point[taken],
        count[taken].astype(np.float32),
    )


@njit(nogil=True, cache=True)
def _find_nearest(middles, bounds, positions, usable, nearest):
    """Nearest usable point of the blocks of m modules, as its place among all points; -1 without
    one.

    Parameters
    ----------
    middles : (m, b, 3) float32 [m]
    bounds : (2, m) int64
        First and last patch + 1 of the surface of each module.
    positions : (c, k, 3) float32 [m]
        Points of patches.
    usable : (c, k) bool
    nearest : (m, b) int64
        -1 before; written where there is a point.
    """
    count = positions.shape[1]
    # A sphere around the points of each patch: patches further away than the best point are passed.
    centre = np.zeros((len(positions), 3), np.float32)
    radius = np.zeros(len(positions), np.float32)
    for patch in range(len(positions)):
        for point in range(count):
            for axis in range(3):
                centre[patch, axis] += positions[patch, point, axis] / np.float32(count)
        for point in range(count):
            x = positions[patch, point, 0] - centre[patch, 0]
            y = positions[patch, point, 1] - centre[patch, 1]
            z = positions[patch, point, 2] - centre[patch, 2]
            radius[patch] = max(radius[patch], np.sqrt(x * x + y * y + z * z))
    for module in range(len(middles)):
        first, last = bounds[0, module], bounds[1, module]
        if first == last:
            continue
        start = first
        for block in range(middles.shape[1]):
            x0, y0, z0 = (
                middles[module, block, 0],
                middles[module, block, 1],
                middles[module, block, 2],
            )
            best = np.float32(np.inf)
            # The patch of the block before comes first, since it is often the same.
            for step in range(last - first + 1):
                patch = start if step == 0 else first + step - 1
                x, y, z = x0 - centre[patch, 0], y0 - centre[patch, 1], z0 - centre[patch, 2]
                if np.sqrt(x * x + y * y + z * z) - radius[patch] > best:
                    continue
                for point in range(count):
                    x = x0 - positions[patch, point, 0]
                    y = y0 - positions[patch, point, 1]
                    z = z0 - positions[patch, point, 2]
                    away = np.sqrt(x * x + y * y + z * z)
                    if away < best and usable[patch, point]:
                        best, nearest[module, block] = away, patch * count + point
            if nearest[module, block] >= 0:
                start = nearest[module, block] // count


def add_losses(table, bits, losses):
    """Write what strings lose at each sun.

    Parameters
    ----------
    table : StringTable
    bits : (p, words, s) uint16
        As of `Shadows`.
    losses : (n, s, len(DIFFUSE_SHARES)) uint8
        In steps of LOSS_STEP: mean of m - f over the strings of each of n surfaces. Written where
        there are strings that something shades.
    """
    shares = np.array(DIFFUSE_SHARES, np.float32)
    surfaces, own = np.unique(table.surface, return_inverse=True)
    means = np.zeros((len(surfaces), bits.shape[2], len(shares)), np.float32)
    entries = table.patch, table.point, table.count
    _add_strings(bits, (own, table.blocks, table.weight, table.start), entries, shares, means)
    losses[surfaces] = np.rint(means / np.float32(LOSS_STEP))


@njit(nogil=True, cache=True)
def _add_strings(bits, strings, entries, shares, means):
    """Add what each string loses, by its weight, to its surface.

    Parameters
    ----------
    bits : (p, words, s) uint16
    strings : tuple of (q,) int64, (q,) float32, (q,) float32 and (q + 1,) int64
        Row of `means`, and fields of StringTable.
    entries : tuple of (e,) int64, (e,) int64 and (e,) float32
        Fields of StringTable.
    shares : (d,) float32
    means : (r, s, d) float32
        Added to.
    """
    (own, blocks, weight, start), (patch, point, count) = strings, entries
    lit = np.empty(bits.shape[2], np.float32)
    one = np.float32(1)
    for string in range(len(own)):
        for sun in range(len(lit)):
            lit[sun] = 0
        for entry in range(start[string], start[string + 1]):
            row, word, shift = patch[entry], point[entry] // WORD, point[entry] % WORD
            for sun in range(len(lit)):
                lit[sun] += count[entry] * np.float32((bits[row, word, sun] >> shift) & 1)
        for sun in range(len(lit)):
            free = lit[sun] / blocks[string]
            if 0 < free < one:
                for node in range(len(shares)):
                    loss = min((one - free) * shares[node], free * (one - shares[node]))
                    means[own[string], sun, node] += weight[string] * loss
