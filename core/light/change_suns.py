"""Light of single suns on the surfaces of an edited city, from what changed.

visible share      of surfaces with a patch that has a changed bit, from all of its bits
first reflection   of the change, exact: rows that stay, off points that see a sun now or no longer;
                   rows traced anew, less what they were
further ones       their sum over the suns is known; over the suns they have the pattern of the
                   city's mean
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit
from scipy import sparse

from .form_factor_loops import link_patches
from .form_factor_products import multiply_visible, scales_of
from .form_factors import FormFactors, leave_rows
from .shadow_points import WORD
from .solve_suns import SunTask, solve_suns
from .sun_blocks import FIRST_SUNS, block_of_suns
from .sun_matrix import LIMIT
from .sun_visibility import Shadows, count_visible, weigh_points
from .trace_all import GatherContext
from .trace_gather import TracedCity

SMALL = 4e6  # patches times suns, up to which all suns are solved: half a second
EACH_SUN = "each sun"  # the stage that follows the preview
GUESSED = 7e-5  # of reflected light that one edit may give the mean's pattern


@dataclass
class Edit:
    """An edit of a traced city while it is traced: patches and surfaces of the city before keep
    their numbers.
    """

    before: TracedCity
    context: GatherContext  # of the edited city
    traced: list  # of Traced, in each state of trees
    anew: np.ndarray  # (p,) bool, patches whose rows were traced anew
    task: SunTask | None = None  # with the bits of all suns
    bits: np.ndarray | None = None  # (states, o, words, s) uint16, of the city before
    touched: np.ndarray | None = None  # (p,) bool, patches with a changed bit
    traced_pairs: int = 0  # pairs of a patch and a sun whose shadows were traced again
    lights: list = field(default_factory=list)  # of the lights of each state
    direct: list = field(default_factory=list)  # of SunLight of each state
    # (p, k) uint64, cells without room, as of TracedCity
    cramped: np.ndarray | None = None
    laid: np.ndarray | None = None  # (n,) bool, surfaces whose modules were laid anew
    hooks: list = field(default_factory=list)  # of light by way of mirrors in each state, or None

    def state_before(self, state):
        """TracedState of the city before the edit, which may have fewer states."""
        return self.before.states[min(state, len(self.before.states) - 1)]

    def lost_rows(self):
        """Patches of the city before whose rows no longer hold, and that are not gone:
        (o,) bool.
        """
        count = len(self.before.context.patches)
        return self.anew[:count] & self.context.patches.receives[:count]

    def bits_before(self, state):
        """Bits of the city before in a state of trees: (o, words, s) uint16."""
        return self.bits[min(state, len(self.bits) - 1)]


def change_suns(edit, drift):
    """Write visible share and reflected light of each sun to the SunLight of an edited city.

    Where the city is large and has no mirrors, and albedos and the number of its trees' states
    stay, visible share and first reflections follow for each sun from what changed, and further
    reflections in part from their mean over the suns, as a guess. Else, or where guesses add up,
    all are solved.

    Parameters
    ----------
    edit : Edit
    drift : float
        Share of reflected light that has the mean's pattern over the suns by earlier edits.

    Returns
    -------
    float
        Such share by all edits, this one among them; 0 where all suns were solved.
    """
    old, context, states = edit.before, edit.context, len(edit.traced)
    count, first = context.patch_to_surface.shape[0], len(edit.before.context.patches)
    albedo, receives = context.patches.albedo[:first], context.patches.receives[:first]
    # In a large city, whose matrices still fit into memory, light follows from what the change adds
    # and takes away; but not with mirrors, another albedo, or another number of trees' states.
    if (
        states == len(old.states)
        and len(context.patches) * len(edit.task.suns) > SMALL
        and 4 * count * len(edit.task.suns) <= LIMIT
        and not any(edit.hooks)
        and (albedo == old.context.patches.albedo)[receives].all()
    ):
        guessed = 0.0
        for state, direct in enumerate(edit.direct):
            direct.visible_share = _visible_share(edit, state)
            context.progress(EACH_SUN, 3 * state + 1, 3 * states + 2, "steps")
            direct.reflected = _first_reflections(edit, state)
            context.progress(EACH_SUN, 3 * state + 2, 3 * states + 2, "steps")
            guessed += _add_further(edit, state) / states
        # This is kept if the edit gives at most 0.05 % of the reflected light the mean's pattern,
        # and all edits together at most a tenth.
        if guessed <= GUESSED and drift + guessed <= 0.1:
            return drift + guessed
    # Else, or where a guess would count for too much, all suns are solved again.
    solved = solve_known_suns(context, edit.traced, edit.task, edit.hooks)
    for direct, new in zip(edit.direct, solved, strict=True):
        direct.visible_share, direct.reflected, direct.specular = (
            new.visible_share,
            new.reflected,
            new.specular,
        )
    return 0.0


def solve_known_suns(context, traced, task, hooks):
    """Light of each sun where it is known which points see it, without a ray: list of SunLight, as
    of `solve_suns`.
    """
    return solve_suns(context, traced, _with_known(task, task.blocks), hooks)


def with_first_days(task):
    """A SunTask that need not look at the suns by which the number of reflections is chosen."""
    return _with_known(task, [block for block in task.blocks if block.start < FIRST_SUNS])


def _with_known(task, blocks):
    """A SunTask that knows from its bits which points see the suns of some blocks."""
    weight, points = weigh_points(task.watch), task.watch.points
    shadows = {
        block.start: [
            Shadows(np.ascontiguousarray(bits[:, :, block]), points, weight, 0)
            for bits in task.bits
        ]
        for block in blocks
    }
    return replace(task, traced_shadows=shadows)


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
    watch = edit.task.watch
    weight, counted = weigh_points(watch)[rows], watch.points.counted[rows]
    own = np.empty((len(rows), share.shape[1]), np.float32)
    count_visible(edit.task.bits[state][rows], counted, weight, own)
    share[surfaces] = to_surface[surfaces][:, rows] @ own
    return share


def _first_reflections(edit, state):
    """Reflected light of surfaces before the edit, plus what the first reflection gains and loses
    by it under each sun: (n, s) float32.
    """
    # Without reflections the old light is returned, with rows for new surfaces.
    old, context, task, before = edit.before, edit.context, edit.task, edit.state_before(state)
    to_surface, todo, traced = context.patch_to_surface, edit.anew, edit.traced[state]
    reflected_light = _grow(before.direct.reflected, to_surface.shape[0])
    if not context.bounces:
        return reflected_light
    first, ff, old_ff = len(old.context.patches), traced.form_factors, before.traced.form_factors
    # weight  of each patch in its surface's mean; bits  points that see each sun, now and before.
    weight = np.zeros(len(context.patches), np.float32)
    flat = to_surface.tocoo()
    weight[flat.col] = flat.data
    bits, old_bits = task.bits[state], edit.bits_before(state)
    block = block_of_suns(task.suns, slice(None))
    towards = np.ascontiguousarray(block.directions.T)
    # Rows that stay: what they see of points that see a sun now, less of those that no longer do.
    points, old_points = (
        task.watch.points.representative_points,
        old.task.watch.points.representative_points,
    )
    rows = np.flatnonzero(edit.touched[:first])
    entry, sun, element, sign = _list_changes(
        (bits[rows], points[rows]), (old_bits[rows], old_points[rows])
    )
    number = np.full(len(context.patches), -1)
    number[rows] = np.arange(len(rows))
    starts = np.searchsorted(entry * ff.elements + element, np.arange(len(rows) * ff.elements + 1))
    shine = context.patches.albedo
    lost = todo[:first] | ~context.patches.receives[:first]
    for part in old_ff.rows:
        some = part.chosen
        own = ~lost[some] & (context.owner[some] >= 0)
        if own.any():
            _add_changes(
                (some, part.start, part.key, own),
                (*scales_of(old_ff), old_ff.elements),
                (number, starts, sun, sign),
                (shine, context.patches.normal, towards),
                (weight, context.owner, reflected_light),
            )
    # Rows traced anew, less what they were.
    anew = todo & (context.owner >= 0)
    gone = lost & (old.context.owner >= 0) & context.patches.receives[:first]
    light = _light_of_rows(
        ff, anew, (shine, context.patches.normal, points), (block.directions, bits), context
    )
    rows = np.flatnonzero(anew)
    reflected_light += (to_surface[:, rows] @ light[rows]).astype(np.float32)
    seen = old.context.patches.albedo, old.context.patches.normal, old_points
    light = _light_of_rows(old_ff, gone, seen, (block.directions, old_bits), context)
    rows = np.flatnonzero(gone)
    reflected_light -= (to_surface[:, rows] @ light[rows]).astype(np.float32)
    return reflected_light


def _light_of_rows(form_factors, chosen, seen_by, suns, context):
    """First reflections of each sun on some patches, (p,) bool: (p, s) float32."""
    parts = [leave_rows(rows, chosen[rows.chosen]) for rows in form_factors.rows]
    some = FormFactors(
        [parts],
        form_factors.count,
        form_factors.elements,
        form_factors.rays,
        form_factors.start_elements,
    )
    return multiply_visible(some, seen_by, suns, context.threads)


def _list_changes(now, before):
    """Elements of patches that see a sun now and did not before, or the other way round: patch,
    sun, element, and 1 or -1, by patch and element.

    Parameters
    ----------
    now, before : tuple of (c, words, s) uint16 and (c, cells) int
        Which points of patches see which suns, and the point that stands for each element.
    """
    # Only pairs of a patch and a sun with another bit, or of a patch with other points, are asked.
    moved = (now[1] != before[1]).any(axis=1)
    patch, sun = np.nonzero((now[0] != before[0]).any(axis=1) | moved[:, None])
    changes = []
    for element in range(now[1].shape[1]):
        lit = []
        for bits, points in (now, before):
            word, bit = np.divmod(points[patch, element].astype(np.int64), WORD)
            lit.append(bits[patch, word, sun] >> bit.astype(np.uint16) & 1)
        other = np.flatnonzero(lit[0] != lit[1])
        sign = np.where(lit[0][other], 1, -1).astype(np.float32)
        changes.append((patch[other], sun[other], np.full(len(other), element), sign))
    patch, sun, element, sign = (np.concatenate(part) for part in zip(*changes, strict=True))
    order = np.argsort(patch * now[1].shape[1] + element, kind="stable")
    return patch[order], sun[order], element[order], sign[order]


@njit(nogil=True, cache=True)
def _add_changes(rows, scale, changes, patches, surfaces):
    """Add to surfaces what rays carry to them from elements that see a sun now, or no longer.

    Parameters
    ----------
    rows : tuple of (c,) int, (c + 1,) int64, (e,) int32 and (c,) bool
        Fields of Rows, and which rows count.
    scale : tuple
        As of the loops of form factors, and the cells of a patch.
    changes : tuple of (p,) int, (k + 1,) int, (m,) int and (m,) float32
        Number of each patch among those that changed, or -1; where the changes of each of their
        elements begin; sun and sign of each.
    patches : tuple of (p,) float32, (p, 3) float32 and (3, s) float32
        Albedo times points for which one stands, normals, and directions of the suns.
    surfaces : tuple of (p,) float32, (p,) int and (n, s) float32
        Share of each patch in its surface, that surface, and the light of surfaces, which is added
        to.
    """
    (chosen, start, key, own), (to_patch, to_cell, shares, cells) = rows, scale
    (number, starts, suns, sign), (shine, normal, towards), (weight, owner, found) = (
        changes,
        patches,
        surfaces,
    )
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
            # Element that the ray met, and the light it passes on under each sun that it sees now
            # or no longer.
            place = number[met] * cells + ((key[entry] >> to_cell) & inside)
            part = share * shine[met]
            for change in range(starts[place], starts[place + 1]):
                sun = suns[change]
                cosine = normal[met, 0] * towards[0, sun] + normal[met, 1] * towards[1, sun]
                cosine += normal[met, 2] * towards[2, sun]
                total[sun] += sign[change] * part * cosine


def _add_further(edit, state):
    """Let reflected light of the suns add up to the annual light's; return the share of it that a
    guess adds.

    Rows traced anew pass on what they meet: of each patch its annual light, over the suns like that
    of its surface. What is left has the pattern of all surfaces of the same kind and orientation.
    `reflected` of the state's SunLight is written; without reflections it stays, and the share is
    0.
    """
    context, direct, before = edit.context, edit.direct[state], edit.state_before(state)
    if not context.bounces:
        return 0.0
    # patterns  how reflected light of each kind and orientation is spread over the suns.
    traced, area, first = edit.traced[state], context.surfaces.area, direct.reflected
    suns = block_of_suns(edit.task.suns, slice(None))
    patterns = _patterns_of_groups(context.surfaces, before.direct.reflected)
    # whole  annual reflected light of each surface, without what the far ground brings.
    far = traced.far_ground.mean(axis=1)
    whole = edit.lights[state]["suns"].by_replicate.mean(axis=1, dtype=float) - direct.annual.light
    whole = context.patch_to_surface @ (whole - direct.annual.lit_ground * far)
    ground = np.outer(context.patch_to_surface @ far, np.maximum(suns.directions[:, 2], 0))
    ground *= context.ground_albedo
    totals = patterns @ suns.weights

    def complete(reflected):
        """Add what lacks in the sum over the suns, and how much that is."""
        lack = whole - reflected @ suns.weights
        share = np.divide(lack, totals, out=np.zeros(len(lack)), where=totals > 0)
        return np.maximum(reflected + (share[:, None] * patterns).astype(np.float32), 0), lack

    # What rows that are gone or traced anew passed on before is taken away, and a guess brings the
    # sum to the whole. Then, twice, the guess is taken out again, what rows traced anew pass on
    # under this light is put in, and a new guess completes the sum; the last one gives the share.
    lost, old = edit.lost_rows(), before.direct.reflected
    own = before.traced, before.lights, before.direct
    first[: len(old)] -= _pass_on(
        edit.before.context, own, lost, old + ground[: len(old)], suns.weights
    )
    further, own = complete(first)[0], (traced, edit.lights[state], direct)
    for _ in range(2):  # what new surfaces pass on to each other
        further, lack = complete(
            first + _pass_on(context, own, edit.anew, further + ground, suns.weights)
        )
    direct.reflected, light = further, float(area @ whole)
    return float(area @ np.abs(lack)) / light if light > 0 else 0.0


def _patterns_of_groups(surfaces, known):
    """Reflected light of each sun as on the first surfaces of the same kind and orientation: (n, s)
    float64.

    `known`, (k, s) float32, belongs to the first surfaces; where none is of that kind, the mean of
    all is taken.
    """
    kinds = np.char.add(*(np.asarray(part, str) for part in (surfaces.kind, surfaces.orientation)))
    area, patterns = surfaces.area[: len(known)], np.empty((len(kinds), known.shape[1]))
    for kind in np.unique(kinds):
        rows = np.flatnonzero(kinds == kind)
        old = rows[rows < len(known)]
        mean = area[old] @ known[old]
        patterns[rows] = mean if mean.any() else area @ known
    return patterns


def _pass_on(context, own, rows, seen, weights):
    """What some patches, (p,) bool, receive of reflected light that is reflected again: surfaces'
    light (n, s) float32.

    Parameters
    ----------
    context : GatherContext
    own : tuple of Traced, lights and SunLight
    rows : (p,) bool
    seen : (n, s) float64
        Reflected light of surfaces, whose course over the suns their patches share.
    weights : (s,) float32
    """
    (traced, lights, direct), to_surface = own, context.patch_to_surface
    count, patches = to_surface.shape[0], len(context.patches)
    # Patches of the ground have the mean course of all surfaces.
    courses = np.concatenate([seen, context.surfaces.area[None] @ seen])
    totals = courses @ weights
    annual = lights["suns"].by_replicate.mean(axis=1, dtype=float) - direct.annual.light
    owner = np.where(context.owner >= 0, context.owner, count)
    amount = np.divide(annual, totals[owner], out=np.zeros(patches), where=totals[owner] > 0)
    spread = sparse.csr_matrix((amount, (np.arange(patches), owner)), shape=(patches, count + 1))
    passed, factor = np.zeros((count, len(weights)), np.float32), traced.factor.ravel()
    rows = rows & (context.owner >= 0)
    for part in traced.form_factors.rows:
        some = leave_rows(part, rows[part.chosen])
        if not len(some.chosen):
            continue
        start, met, weight = link_patches(
            (some.chosen, some.start, some.key), scales_of(traced.form_factors), factor
        )
        links = sparse.csr_matrix((weight, met, start), shape=(len(some.chosen), patches))
        passed += (to_surface[:, some.chosen] @ (links @ spread)) @ courses
    return passed
