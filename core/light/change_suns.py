"""Light of single suns on the surfaces of an edited city, from what changed.

visible share      of surfaces with a patch of which a bit changed, from all of its bits
first reflection   of the change, exact: rows that stay, off points that see a sun now or no longer;
                   rows traced anew, less what they were
further ones       their sum over the suns is known; over the suns they have the pattern of the city's mean
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit

from .form_factor_products import multiply_visible, scales_of
from .form_factors import FormFactors, leave_rows
from .kept_matrix import LIMIT
from .solve_suns import solve_suns
from .sun_blocks import FIRST_SUNS, block_of_suns
from .sun_visibility import Shadows, count_visible, weigh_points

SMALL = 4e6  # patches times suns, up to which all suns are solved: half a second
DRIFT = 0.1  # of reflected light: when what has the mean's pattern adds up to more, all suns are solved


@dataclass
class Edit:
    """An edit of a traced city while it is traced: patches and surfaces of the city before keep their numbers."""

    before: object  # TracedCity
    context: object  # GatherContext of the edited city
    traced: list  # of Traced, in each state of trees
    anew: np.ndarray  # (p,) bool, patches whose rows were traced anew
    task: object = None  # SunTask with the bits of all suns
    touched: np.ndarray | None = None  # (p,) bool, patches of which a bit changed
    looked: int = 0  # pairs of a patch and a sun that were looked at
    lights: list = field(default_factory=list)  # of the lights of each state
    direct: list = field(default_factory=list)  # of SunLight of each state
    hooks: list = field(default_factory=list)  # of light by way of mirrors in each state, or None

    def state_before(self, state):
        """TracedState of the city before, of which there may be fewer."""
        return self.before.states[min(state, len(self.before.states) - 1)]

    def bits_before(self, state):
        """Bits of the city before in a state of trees: (o, words, s) uint16."""
        bits = self.before.task.bits
        return bits[min(state, len(bits) - 1)]


def change_suns(edit, drift):
    """Write visible share and reflected light of each sun to the SunLight of an edited city.

    Parameters
    ----------
    edit : Edit
    drift : float
        Share of reflected light that has the mean's pattern over the suns by earlier edits.

    Returns
    -------
    float
        The same by all edits.
    """
    old, context, states = edit.before, edit.context, len(edit.traced)
    count, first = context.patch_to_surface.shape[0], len(edit.before.context.patches)
    albedo, receives = context.patches.albedo[:first], context.patches.receives[:first]
    if (
        states == len(old.states)
        and len(context.patches) * len(edit.task.suns) > SMALL
        and 4 * count * len(edit.task.suns) <= LIMIT
        and not any(edit.hooks)
        and (albedo == old.context.patches.albedo)[receives].all()
    ):
        for state, direct in enumerate(edit.direct):
            direct.visible_share = _visible_share(edit, state)
            direct.reflected = _first_reflections(edit, state)
            drift += _add_further(edit, state) / states
        if drift <= DRIFT:
            return drift
    for direct, new in zip(edit.direct, solve_known_suns(edit), strict=True):
        direct.visible_share, direct.reflected, direct.specular = new.visible_share, new.reflected, new.specular
    return 0.0


def solve_known_suns(edit):
    """Light of each sun where it is known which points see it, without a ray: list of SunLight."""
    task = _with_known(edit.task, edit.task.blocks)
    return solve_suns(edit.context, edit.traced, task, edit.hooks)


def with_first_days(task):
    """A SunTask that need not look at the suns by which the number of reflections is chosen."""
    return _with_known(task, [block for block in task.blocks if block.start < FIRST_SUNS])


def _with_known(task, blocks):
    """A SunTask that knows from its bits which points see the suns of some blocks."""
    (turns, weight), points = weigh_points(task.watch), task.watch.points
    looked = {
        block.start: [Shadows(np.ascontiguousarray(bits[:, :, block]), points, turns, weight, 0) for bits in task.bits]
        for block in blocks
    }
    return replace(task, looked=looked)


def _grow(matrix, count):
    """A matrix of surfaces and suns with rows of zeros for new surfaces."""
    grown = np.zeros((count, matrix.shape[1]), np.float32)
    grown[: len(matrix)] = matrix
    return grown


def _visible_share(edit, state):
    """Sunlit share of surfaces for each sun: (n, s) float32."""
    to_surface, owner = edit.context.patch_to_surface, edit.context.owner
    share = _grow(edit.state_before(state).direct.visible_share, to_surface.shape[0])
    surfaces = np.unique(owner[(edit.touched | edit.anew) & (owner >= 0)])
    rows = np.flatnonzero(np.isin(owner, surfaces))
    _, weight = weigh_points(edit.task.watch)
    own = np.empty((len(rows), share.shape[1]), np.float32)
    count_visible(edit.task.bits[state][rows], weight[rows], own)
    share[surfaces] = to_surface[surfaces][:, rows] @ own
    return share


def _first_reflections(edit, state):
    """Reflected light of surfaces with the first reflection of the change: (n, s) float32."""
    old, context, task, before = edit.before, edit.context, edit.task, edit.state_before(state)
    to_surface, todo, traced = context.patch_to_surface, edit.anew, edit.traced[state]
    found = _grow(before.direct.reflected, to_surface.shape[0])
    if not context.bounces:
        return found
    first, ff, old_ff = len(old.context.patches), traced.form_factors, before.traced.form_factors
    weight = np.zeros(len(context.patches), np.float32)
    flat = to_surface.tocoo()
    weight[flat.col] = flat.data
    bits, old_bits = task.bits[state], edit.bits_before(state)
    block = block_of_suns(task.suns, slice(None))
    towards = np.ascontiguousarray(block.directions.T)
    # Rows that stay: what they see of points that see a sun now, less of those that no longer do.
    points, old_points = task.watch.points.representative_points, old.task.watch.points.representative_points
    rows = np.flatnonzero(edit.touched[:first])
    lit = _lit_elements(bits[rows], points[rows]), _lit_elements(old_bits[rows], old_points[rows])
    entry, sun, element, sign = _list_changes(*lit)
    number = np.full(len(context.patches), -1)
    number[rows] = np.arange(len(rows))
    starts = np.searchsorted(entry * ff.cells + element, np.arange(len(rows) * ff.cells + 1))
    turns, _ = weigh_points(task.watch)
    shine = context.patches.albedo * turns.astype(np.float32)
    lost = todo[:first] | ~context.patches.receives[:first]
    for part in old_ff.rows:
        some = part.chosen
        own = ~lost[some] & (context.owner[some] >= 0)
        if own.any():
            add_changes(
                (some, part.start, part.key, own),
                (*scales_of(old_ff), old_ff.cells),
                (number, starts, sun, sign),
                (shine, context.patches.normal, towards),
                (weight, context.owner, found),
            )
    # Rows traced anew, less what they were.
    anew = todo & (context.owner >= 0)
    gone = lost & (old.context.owner >= 0) & context.patches.receives[:first]
    light = _light_of_rows(ff, anew, (shine, context.patches.normal, points), (block.directions, bits), context)
    rows = np.flatnonzero(anew)
    found += (to_surface[:, rows] @ light[rows]).astype(np.float32)
    turns, _ = weigh_points(old.task.watch)
    shine = old.context.patches.albedo * turns.astype(np.float32)
    seen = shine, old.context.patches.normal, old_points
    light = _light_of_rows(old_ff, gone, seen, (block.directions, old_bits), context)
    rows = np.flatnonzero(gone)
    found -= (to_surface[:, rows] @ light[rows]).astype(np.float32)
    return found


def _light_of_rows(form_factors, chosen, seen_by, suns, context):
    """First reflections of each sun on some patches, (p,) bool: (p, s) float32."""
    parts = [leave_rows(rows, chosen[rows.chosen]) for rows in form_factors.rows]
    some = FormFactors([parts], form_factors.count, form_factors.cells, form_factors.rays, form_factors.starts)
    return multiply_visible(some, seen_by, suns, context.threads)


def _lit_elements(bits, points):
    """Which elements of patches see which suns: (c, cells, s) bool."""
    found = np.empty((*points.shape, bits.shape[2]), bool)
    for cell in range(points.shape[1]):
        point = points[:, cell].astype(np.int64)
        word = np.take_along_axis(bits, (point >> 4)[:, None, None], axis=1)[:, 0]
        found[:, cell] = (word >> (point & 15)[:, None].astype(np.uint16)) & 1
    return found


def _list_changes(now, before):
    """Where two arrays of bool, (c, cells, s), differ: patch, sun, element, and 1 or -1, by patch and element."""
    patch, element, sun = np.nonzero(now != before)
    return patch, sun, element, np.where(now[patch, element, sun], 1, -1).astype(np.float32)


@njit(nogil=True, cache=True)
def add_changes(rows, scale, changes, patches, surfaces):
    """Add to surfaces what rays carry to them from elements that see a sun now, or no longer.

    Parameters
    ----------
    rows : tuple of (c,) int, (c + 1,) int64, (e,) int32 and (c,) bool
        Fields of Rows, and which rows count.
    scale : tuple
        As of the loops of form factors, and the cells of a patch.
    changes : tuple of (p,) int, (k + 1,) int, (m,) int and (m,) float32
        Number of each patch among those that changed, or -1; where the changes of each of their elements begin; sun
        and sign of each.
    patches : tuple of (p,) float32, (p, 3) float32 and (3, s) float32
        Albedo times points for which one stands, normals, and directions of the suns.
    surfaces : tuple of (p,) float32, (p,) int and (n, s) float32
        Share of each patch in its surface, that surface, and the light of surfaces, which is added to.
    """
    (chosen, start, key, own), (to_patch, to_cell, shares, cells) = rows, scale
    (number, starts, suns, sign), (shine, normal, towards), (weight, owner, found) = changes, patches, surfaces
    inside = (1 << (to_patch - to_cell)) - 1
    for row in range(len(chosen)):
        if not own[row]:
            continue
        patch = chosen[row]
        total, share = found[owner[patch]], shares[patch] * weight[patch]
        for entry in range(start[row], start[row + 1]):
            met = key[entry] >> to_patch
            if number[met] < 0:
                continue
            place = number[met] * cells + ((key[entry] >> to_cell) & inside)
            part = share * shine[met]
            for change in range(starts[place], starts[place + 1]):
                sun = suns[change]
                cosine = normal[met, 0] * towards[0, sun] + normal[met, 1] * towards[1, sun]
                cosine += normal[met, 2] * towards[2, sun]
                total[sun] += sign[change] * part * cosine


def _add_further(edit, state):
    """Let reflected light add up to that of the annual light; return the share of it that this adds."""
    context, traced, direct = edit.context, edit.traced[state], edit.direct[state]
    if not context.bounces:
        return 0.0
    reflected, before = direct.reflected, edit.state_before(state).direct.reflected
    annual, weights = direct.annual, block_of_suns(edit.task.suns, slice(None)).weights
    whole = edit.lights[state]["suns"].by_replicate.mean(axis=1, dtype=float) - annual.light
    whole = context.patch_to_surface @ (whole - annual.lit_ground * traced.far_ground.mean(axis=1))
    lack = whole - reflected @ weights
    area = context.surfaces.area
    # Of the same kind and orientation: what light comes from around a surface follows the sun likewise.
    kinds = np.char.add(*(np.asarray(part, str) for part in (context.surfaces.kind, context.surfaces.orientation)))
    whole_city = area[: len(before)] @ before
    for kind in np.unique(kinds):
        rows = np.flatnonzero(kinds == kind)
        old = rows[rows < len(before)]
        pattern = area[old] @ before[old]
        pattern = pattern if pattern.any() else whole_city
        total = float(pattern @ weights)
        if total > 0:
            reflected[rows] += np.outer(lack[rows], pattern / total).astype(np.float32)
    np.maximum(reflected, 0, out=reflected)
    light = float(area @ whole)
    return float(area @ np.abs(lack)) / light if light > 0 else 0.0
