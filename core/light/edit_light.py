"""Light of an edited city: what the edit leaves as it was comes from the city before, all else is traced.

    patches      the same before and after, by all that their rays follow from ─► place
    rays         of these patches, sent again at the changed triangles alone; those that meet one are compared in the
                 two cities. A patch with a ray that ends elsewhere, or with other covered cells, is traced anew
    shadows      each patch looks again at the suns that stand behind the boxes of what has changed

The result is that of a run of the edited city: the same rays with the same random numbers, and the same solution.
Only where two triangles share an edge or coincide may a ray meet the other one, as it may with another ray tracer.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..city.scene import corners_of
from ..effects.beyond_scene import sky_of_surfaces
from ..rays.hemisphere_rays import hemisphere_rays
from ..rays.ray_scene import RayScene
from ..rays.sample_points import HEMISPHERE_REPLICATES, sobol_digits
from ..rays.trail import AROUND, ROUNDING, begin_trail, boxes_of, boxes_of_patches
from ..settings.errors import InputError
from ..settings.progress import silent
from ..settings.threads import map_in_order, work_in_slices
from .compare_cities import match_patches, name_trees, pass_boxes, rays_through
from .editable_city import EditableCity, prepare_decided
from .form_factors import Rows, leave_rows
from .measure_cover import find_cover
from .prepare_scene import BaseTooSmallError, build_tree
from .trace_gather import trace_light
from .trace_hemisphere import LEAST, RAYS_PER_TASK, source_rays

MATCHING, STAGE = "comparing patches", "comparing rays"
NEARLY = 1e-3  # [m] more than rounding of places in single precision


def trace_editable(prepared, suns, request, progress=silent, *, specular=lambda prepared: None, known=None):
    """Trace a city so that it can be edited.

    Parameters
    ----------
    prepared : PreparedScene
    suns : Suns
    request : Request
    progress : callable, optional
        See `core.progress`.
    specular : callable, optional
        As of `EditableCity`.
    known : Known, optional
        Of the city before an edit.

    Returns
    -------
    EditableCity

    Raises
    ------
    CancelledError
    InputError
        It is a tile, a further round, or asks for another estimator than gather.
    """
    if request.estimator != "gather":
        raise InputError("--estimator", f"a run with {request.estimator} cannot be edited", "give gather")
    if prepared.scene.halo is not None:
        raise InputError("the base", "it was traced in tiles, which cannot be edited", "trace it without tiles")
    if prepared.patches.points_before.any():
        raise InputError("the base", "it has further rounds, which cannot be edited", "trace it in one round")
    prepared = replace(build_tree(prepared, request), editable=True)
    boxes = boxes_of_patches(prepared.patches)
    trail = known.trail.of_others(boxes, known.place) if known else begin_trail(prepared.scene, boxes)
    prepared.plan.ray_scene.trail = trail
    city = trace_light(prepared, suns, request, progress, specular=specular(prepared), known=known)
    return EditableCity(suns, request, city, trail, specular)


def edit_light(base, scene, progress=silent, *, request=None, preview=None):
    """Trace an edited city from what is known of the city before.

    Parameters
    ----------
    base : EditableCity
    scene : Scene
        Of the edited city, made with the site of the base (`SceneOptions.site`).
    progress : callable, optional
    request : Request, optional
        With other materials than the base's.
    preview : callable, optional
        `preview(diffuse, direct)` gets the light of the edited city's surfaces per DHI, and per DNI as the sum over the
        suns by their weights, both (n,), before each sun is solved; of a city with deciduous trees first in leaf, then
        bare. Light by way of mirrors is in the first only.

    Returns
    -------
    EditableCity
        Its plan, suns and number of reflections are those of the base, as long as these are enough for it.

    Raises
    ------
    CancelledError
    InputError
        The base was interrupted, the scene has another site, or asks for another sky or for more reflections.
    """
    if base.transfer.record.interrupted:
        raise InputError("the base", "its run was interrupted", "trace it again, to the end")
    if scene.site != base.scene.site:
        raise InputError("the edited city", "it has another place on Earth or origin", "build it with the base's site")
    request = request or base.request
    sky, has = sky_of_surfaces(request, scene.surfaces), base.decisions.plan["sky"]
    if sky != has:
        raise BaseTooSmallError(f"asks for the {sky} sky, the {has} one was traced", {"sky": sky})
    prepared = prepare_decided(base.decisions, scene, request, progress)
    progress(MATCHING, 0, len(prepared.patches), "patches")
    prepared = build_tree(prepared, request)
    progress(MATCHING, 0, len(prepared.patches), "patches")
    known = Known(base.city, prepared, base.trail, preview, progress)
    return trace_editable(prepared, base.suns, request, progress, specular=base.specular, known=known)


class Known:
    """What a city before an edit tells of the edited one, patch by patch.

    Parameters
    ----------
    before : TracedCity
    prepared : PreparedScene
        Of the edited city, with its tree.
    trail : Trail
        Of the city before.
    preview, progress : callable, optional
        As of `edit_light`.
    """

    def __init__(self, before, prepared, trail, preview=None, progress=silent):
        self.before, self.prepared, self.trail = before, prepared, trail
        self.preview, self.progress = preview, progress
        self.place = match_patches(before.prepared, prepared)  # (p,) int, of the patch before; -1: it is new
        progress(MATCHING, len(self.place), len(self.place), "patches")
        self.after = np.full(len(before.prepared.patches), -1)  # (o,) int, the other way round
        self.after[self.place[self.place >= 0]] = np.flatnonzero(self.place >= 0)

    @cached_property
    def solids(self):
        """Triangles of patches that only one of the two cities has: (k, 3, 3) [m]."""
        scenes = (self.before.prepared.scene, self.after < 0), (self.prepared.scene, self.place < 0)
        return np.concatenate([corners_of(*one) for one in scenes])

    @cached_property
    def crowns(self):
        """Triangles of trees that only one of the two cities has: (k, 3, 3) float64 [m]."""
        foliage = [one.plan.foliage for one in (self.before.prepared, self.prepared)]
        trees = [name_trees(one) for one in foliage]
        changed = [
            one.crowns.vertices[one.crowns.triangles[~np.isin(mine, theirs)[one.crowns.tree]]]
            for one, mine, theirs in zip(foliage, trees, trees[::-1], strict=True)
            if one is not None
        ]
        return np.concatenate([np.zeros((0, 3, 3)), *changed])

    @cached_property
    def boxes(self):
        """Boxes around all that has changed: (b, 2, 3) float64 [m]."""
        return boxes_of(np.concatenate([self.solids, self.crowns]))

    @cached_property
    def asked(self):
        """Patches of which something else may be covered, or without room for modules: (p,) bool."""
        return (self.place < 0) | self.trail.passing(self.boxes[1:])[self.place]

    @cached_property
    def same(self):
        """Patches the city had before, covered as before, and whose rays end at the same triangles: (p,) bool."""
        before, place, patches = self.before, self.place, self.prepared.patches
        context, traced, now = before.context, before.states[0].traced, self.prepared.plan.ray_scene
        covered = traced.covered[place]
        same, in_earth = (place >= 0) & (traced.samples[place] > 0), covered.any(axis=1)
        self.progress(STAGE, 0, 1, "tasks")
        rows = np.flatnonzero(same & ~covered.all(axis=1)) if len(self.boxes) else np.zeros(0, int)
        scenes = [
            RayScene(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
            for corners in (self.solids, self.crowns)
        ]
        number = np.append(np.where(self.after < 0, -2, self.after), -1)

        def differ(task):
            """Which patches of a task have a ray that ends elsewhere now."""
            chosen, count = task
            other, sequence = np.zeros(len(chosen), bool), sobol_digits(count // HEMISPHERE_REPLICATES)
            normal, corner = patches.normal[chosen].astype(float), patches.corner[chosen].astype(float)
            ahead = ((np.where(normal > 0, self.boxes[0, 1], self.boxes[0, 0]) - corner) * normal).sum(axis=1) > -NEARLY
            facing = np.flatnonzero(ahead | in_earth[chosen])
            for rows, rays in rays_of_patches(context, patches, chosen[facing], sequence):
                origins, directions = (np.ascontiguousarray(part.reshape(-1, 3)) for part in rays)
                owner = np.repeat(facing[rows], rays[0].shape[1])
                # Along the ground line rays are tested for starting below ground.
                low = np.flatnonzero(in_earth[chosen[owner]])
                up = np.tile(np.float32([0, 0, 1]), (len(low), 1))
                other[owner[low][scenes[0].trace_closest(origins[low], up) >= 0]] = True
                near = rays_through((origins, directions), self.boxes[0], ROUNDING)
                origins, directions, owner = origins[near], directions[near], owner[near]
                other[owner[scenes[1].trace_closest(origins, directions) >= 0]] = True
                met = scenes[0].trace_closest(origins, directions) >= 0
                ends = [one.trace_places(origins[met], directions[met]).triangle for one in (context.ray_scene, now)]
                other[owner[met][number[ends[0]] != ends[1]]] = True
            return chosen[other]

        tasks, counts = [], traced.samples[place[rows]]
        for count in np.unique(counts):
            some, step = rows[counts == count], max(1, RAYS_PER_TASK // int(count))
            tasks += [(some[start : start + step], int(count)) for start in range(0, len(some), step)]
        for done, changed in enumerate(map_in_order(differ, tasks, context.threads)):
            self.progress(STAGE, done, len(tasks), "tasks")
            same[changed] = False
        asked = same & self.asked
        found = find_cover(now, patches, asked, context.threads, self.progress)
        return same & ~(asked & (found != covered).any(axis=1))

    @cached_property
    def states(self):
        """What the rays met in each state of the trees, as many as now: list of Traced."""
        found = [one.traced for one in self.before.states]
        return [found[min(state, len(found) - 1)] for state in range(self.prepared.states)]

    @cached_property
    def rows(self):
        """Hits of these patches' rays, with the numbers that patches have now: a list of Rows of each state."""
        kept, found = np.append(self.same, False)[self.after], []
        rising = (np.diff(self.place[self.place >= 0]) > 0).all()
        for form_factors in (one.form_factors for one in self.states):
            found.append([])
            for rows in form_factors.rows if form_factors else ():
                part = leave_rows(rows, kept[rows.chosen])
                bits = form_factors.start_bits + form_factors.cells.bit_length() - 1
                key = (self.after[part.key >> bits] << bits | part.key & (1 << bits) - 1).astype(np.int32)
                if not rising:
                    key = key[np.lexsort([key, np.repeat(np.arange(len(part.chosen)), np.diff(part.start))])]
                found[-1].append(Rows(self.after[part.chosen], part.start, key, part.rays))
        return found

    def put(self, found, chosen):
        """Write what is known of some patches, (p,) bool, to the Traced of each state: (p,) bool, of which."""
        known = chosen & self.same & (self.states[0].samples[self.place] == found[0].samples)
        rows = self.place[known]
        for new, old, hits in zip(found, self.states, self.rows, strict=True):
            for name, first in new.first.items():
                for part in ("light", "element", "deviation"):
                    getattr(first, part)[known] = getattr(old.first[name], part)[rows]
            for name in ("far_ground", "element_far_ground", "open_share", "covered"):
                getattr(new, name)[known] = getattr(old, name)[rows]
            for part in hits:
                new.form_factors.put(leave_rows(part, known[part.chosen]))
        return known

    def room(self, clearances):
        """What is known of `measure_room_of_patches`, (p, k) float32: NaN where it is not."""
        old = self.before.room
        if old is None or max(clearances) > AROUND:
            return None
        return np.where(self.asked[:, None], np.float32(np.nan), old[self.place])

    def shadows(self, watch):
        """What is known of the suns: KnownShadows."""
        old, rows = self.before.task.watch, self.place
        turns = [np.ones(len(one.traced), int) if one.turns is None else one.turns for one in (old, watch)]
        kept = (rows >= 0) & watch.traced & old.traced[rows] & (turns[0][rows] == turns[1])
        kept &= (watch.covered == old.covered[rows]).all(axis=1)
        bits = self.before.task.bits
        bits = [bits[min(state, len(bits) - 1)] for state in range(self.prepared.states)]
        # A ball around each patch, rays' origins included.
        patches = watch.patches
        corners = patches.corner[:, None].astype(float) + np.pad(patches.edges.astype(float), ((0, 0), (1, 0), (0, 0)))
        middle = corners.mean(axis=1)
        radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1) + patches.offset + NEARLY
        balls = middle, radius, patches.normal.astype(float)
        return KnownShadows(bits, np.where(kept, rows, -1), balls, self.boxes, watch.threads)


@dataclass
class KnownShadows:
    """Which points of patches saw which suns before an edit."""

    bits: list  # of (o, words, s) uint16, of `Shadows` in each state of the trees
    place: np.ndarray  # (p,) int, the patch before whose bits hold where nothing has changed; -1: none
    balls: tuple  # (p, 3), (p,) and (p, 3) float64 [m], a ball around each patch and its normal
    boxes: np.ndarray  # (k, 2, 3) float64 [m], around all that has changed
    threads: int

    def of_suns(self, columns, directions):
        """Bits of some suns, ascending (s,) int, with directions, (s, 3); and which to look at again: (p, s) bool."""
        first, end = (columns[0], columns[-1] + 1) if len(columns) else (0, 0)
        directions = directions.astype(float)
        bits = np.zeros((len(self.bits), len(self.place), self.bits[0].shape[1], len(columns)), np.uint16)
        asked = np.ones((len(self.place), len(columns)), bool)

        def look(rows):
            kept = np.flatnonzero(self.place[rows] >= 0)
            few = np.empty((len(kept), len(columns)), bool)
            pass_boxes(tuple(part[rows][kept] for part in self.balls), directions, self.boxes, few)
            for new, old in zip(bits, self.bits, strict=True):
                new[rows][kept] = old[:, :, first:end][self.place[rows][kept]][:, :, columns - first]
            asked[rows][kept] = few

        work_in_slices(look, len(self.place), self.threads)
        return bits, asked


def rays_of_patches(city, patches, chosen, sequence):
    """All rays of some patches: a list of which of them, (c,) int, with origins and directions, (c, rays, 3)."""
    found = [(np.arange(len(chosen)), hemisphere_rays(patches, chosen, sequence)[:2])] if len(chosen) else []
    few = sequence[: -(-len(sequence) // city.rays_share)]
    for source in city.sources:
        facing = np.flatnonzero(source.unshaded(patches.normal[chosen]).astype(np.float32) > LEAST)
        if len(facing):
            found.append((facing, source_rays(patches, source, chosen[facing], few, share=city.rays_share)[:2]))
    return found
