"""The scene of an edited city: what stays keeps its row, what is new is appended, what is gone
loses its area.

    base   │ a │ b │ c │ d │ ground …                 surfaces and triangles keep their numbers, so
    that edited │ a │ - │ c │ d │ ground - - … │ b' │ e │   all that is known of them stays where it
    is

The ground stays as it lies, but for a hole under what is new and a patch under what is gone. Sheets
are judged again where the change is near.
"""

import copy
from dataclasses import dataclass, replace

import numpy as np

from ..rays.random_numbers import mix
from ..settings.errors import InputError
from ..settings.tolerances import GEOMETRY
from .build_scene import DRAWN_TWICE, SceneOptions, build_scene
from .change_boxes import boxes_around, touch_boxes
from .city import whole_of_cell
from .classify import classify
from .crowns import build_crowns
from .edited_ground import cut_ground, find_floating_new
from .find_ground import find_hanging
from .find_sheets import find_judged, judge_shapes, shapes_of_scene
from .find_twins import find_twins
from .polygons import measure_polygons, polygon_bounds
from .racks import RACK, lay_racks, parse_racks, roof_of_rack
from .scene import Scene
from .written_scene import owner_of_triangles, remove_triangles


@dataclass
class _SceneChange:
    """What an edit changes of a scene, whose triangles and surfaces keep their numbers."""

    scene: Scene  # edited; triangles that are gone have no area
    rows: np.ndarray  # (k,) int, surfaces of the edited city in its order, racks last
    gone: np.ndarray  # (g,) int, triangles of the scene before
    first: int  # the first new triangle; all behind it are new
    solids: np.ndarray  # (m, 3, 3) float64 [m], triangles that came or went
    crowns: np.ndarray  # (c, 3, 3) float64 [m], triangles of crowns that came or went
    near: np.ndarray  # (t,) bool, triangles near the change
    boxes: np.ndarray  # (b, 2, 3) float64 [m], around all that changed


def edit_scene(scene, rows, before, after, request):
    """Scene of an edited city, changed only where the edit reaches.

    Parameters
    ----------
    scene : Scene
        Before, with the backs of its sheets.
    rows : (k,) int
        Its surfaces in the order of the city, racks last.
    before, after : City
    request : Request

    Returns
    -------
    SceneChange
        The edited scene, the rows of its surfaces, and what came and went. Triangles and surfaces
        of the base keep their numbers; those that are gone stay without area, not eligible.

    Raises
    ------
    InputError
        The edited city cannot be used, or stands on another terrain.
    """
    if not _same_terrain(before.terrain, after.terrain):
        raise InputError(
            "the edited city",
            "stands on another terrain than its base",
            "trace it by citypv simulate",
        )
    # Polygons that both cities have keep their rows; new ones come last, those that are lost go.
    kept = _match_polygons(before, after)
    new = np.flatnonzero(kept < 0)
    names, surface_id = _rows_by_polygon(scene.surfaces.surface_id, rows), before.surface_id
    lost = np.setdiff1d(np.arange(len(before)), kept[kept >= 0])
    gone_rows = np.array([row for k in lost for row in names.get(surface_id[k], ())], int)
    surfaces = replace(
        scene.surfaces, eligible=scene.surfaces.eligible.copy(), area=scene.surfaces.area.copy()
    )
    edited = replace(scene, surfaces=surfaces, report=copy.deepcopy(scene.report), number=None)
    # What is new is built like any city, without ground, in the frame of the base.
    site, first = scene.site, len(scene.triangles)
    added = None
    if len(new):
        part = replace(after.take(kept < 0), trees=[], terrain=None)
        options = SceneOptions(grid_size=request.grid_size, sectors=request.sectors, site=site)
        added = build_scene(part, ground="none", patch_size=request.patch_size, options=options)
        edited = _append_scene(edited, added)
    # The ground has holes where new things stand, and closes where old ones stood. New footprints
    # above it get light from below if they hang.
    gone = np.flatnonzero(np.isin(owner_of_triangles(scene), gone_rows))
    edited, hidden = cut_ground(edited, first, gone, request.patch_size)
    gone = np.concatenate([gone, hidden])
    edited = remove_triangles(edited, gone)
    edited.footprint = edited.footprint & ~find_hanging(
        edited, find_floating_new(edited, len(scene.surfaces))
    )
    # Racks stand on the roofs of what is new.
    racks = parse_racks(request.racks)
    if added is not None and racks:
        edited = lay_racks(edited, part, racks, request.patch_size, request.sectors)
    # What the edit changed in space: triangles that went and came, and crowns of trees.
    crowns = _change_trees(edited, before, after)
    solids = np.concatenate([scene.corners_of(gone), edited.corners_of(np.s_[first:])])
    alive = np.setdiff1d(rows, gone_rows)
    # Within a step of a change, or within --clearance, it is judged again which faces are sheets:
    # without thickness, lit from both sides.
    within = max(GEOMETRY.step, request.clearance)
    asked = np.zeros(len(edited.surfaces) + 1, bool)
    asked[owner_of_triangles(edited)[touch_boxes(edited, boxes_around(solids), within)]] = True
    edited, turned = _judge_sheets(edited, asked[:-1], first)  # the ground's -1 took the last one
    # Backs of faces that are no sheets any more count as gone; then twins are looked for among what
    # remains.
    gone, solids = (
        np.concatenate([gone, turned]),
        np.concatenate([solids, scene.corners_of(turned)]),
    )
    order = _order_rows(edited, alive, len(scene.surfaces), after)
    _find_twins(edited, order, after, solids, request.sectors)
    # Surfaces that are no longer of the city keep their row, without area and not eligible.
    dead = np.setdiff1d(np.arange(len(edited.surfaces)), order)
    edited.surfaces.eligible[dead] = False
    edited.surfaces.area[dead] = 0.0
    # Boxes around all that changed tell which triangles are near it.
    boxes = boxes_around(np.concatenate([solids, crowns]))
    near = touch_boxes(edited, boxes, within)
    return _SceneChange(edited, order, np.unique(gone), first, solids, crowns, near, boxes)


def _same_terrain(one, other):
    """Whether two Terrains, or None, have the same triangles."""
    if one is None or other is None or one is other:
        return one is other
    return len(one.layers) == len(other.layers) and all(
        np.array_equal(a.points[a.triangles], b.points[b.triangles])
        for a, b in zip(one.layers, other.layers, strict=True)
    )


def _hash_polygons(points, ring_start, polygon_start):
    """A number of 64 bits for each polygon, which tells its points and rings: (n,) uint64."""
    words = mix(_place_in_run(ring_start))
    for column in np.ascontiguousarray(points).view(np.uint64).T:
        words = mix(words + np.uint64(1) ^ column)
    rings = mix(np.add.reduceat(words, ring_start[:-1]) ^ mix(_place_in_run(polygon_start)))
    return np.add.reduceat(rings, polygon_start[:-1])


def _place_in_run(start):
    """Number of each member of runs that begin at `start`, (k + 1,), in its run, from 1."""
    return (np.arange(1, start[-1] + 1) - np.repeat(start[:-1], np.diff(start))).astype(np.uint64)


def _match_polygons(before, after):
    """Row before the edit of each polygon with the same name, building, class and points: (n,) int;
    -1: it is new.
    """
    number = {name: row for row, name in enumerate(before.surface_id)}
    place = np.array([number.get(name, -1) for name in after.surface_id], int)
    drawn = [_hash_polygons(*one.shape) for one in (before, after)]
    place[drawn[0][place] != drawn[1]] = -1
    for name in ("building_id", "thematic"):
        old, own = (np.array(getattr(one, name), object) for one in (before, after))
        place[old[place] != own] = -1
    return place


def _rows_by_polygon(surface_id, rows):
    """Surfaces among some rows by the polygon that they are, were cut from, or stand on: dict of
    lists.
    """
    rows_of = {}
    for row in np.asarray(rows).tolist():
        name = surface_id[row]
        rows_of.setdefault(whole_of_cell(roof_of_rack(name) or name), []).append(row)
    return rows_of


def _append_scene(scene, added):
    """The scene with the surfaces and triangles of another one of the same site behind its own."""
    report = scene.report
    for reason, names in added.report.repaired.items():
        report.repair(reason, names)
    count = len(scene.vertices)
    moved = replace(
        scene,
        surfaces=scene.surfaces.join(added.surfaces),
        colours=added.colours | scene.colours,
    ).append_triangles(
        added.triangles + count,
        added.triangle_surface + len(scene.surfaces),
        footprint=added.footprint,
        closure=added.closure,
    )
    return replace(moved, vertices=np.concatenate([scene.vertices, added.vertices]))


def _change_trees(scene, before, after):
    """Give the scene the trees of the edited city; triangles of those that came or went: (c, 3, 3)
    float64 [m].
    """
    none = np.zeros((0, 3, 3))
    names = [[_name_tree(tree) for tree in one.trees] for one in (before, after)]
    if names[0] == names[1]:
        return none
    changed_triangles = [none]
    for one, other in ((before, names[1]), (after, names[0])):
        trees = [tree for tree in one.trees if _name_tree(tree) not in other]
        report = copy.deepcopy(scene.report)
        crowns = build_crowns(trees, report, scene.site.from_files) if trees else None
        changed_triangles += [crowns.vertices[crowns.triangles]] if crowns is not None else []
    scene.trees = build_crowns(after.trees, scene.report, scene.site.from_files)
    return np.concatenate(changed_triangles)


def _name_tree(tree):
    """What tells a tree from others: its shape, place and sizes."""
    place = () if tree.place is None else tuple(np.asarray(tree.place).tolist())
    rings = tuple(ring.tobytes() for polygon in tree.polygons for ring in polygon.rings)
    sizes = tree.height, tree.crown_diameter, tree.trunk_diameter, tree.evergreen, tree.area_density
    return place, rings, sizes


def _judge_sheets(scene, asked, first):
    """The scene with sheets judged again among surfaces that are near a change; backs that are
    gone.

    Returns
    -------
    Scene
    (g,) int
        Triangles before `first` that are gone: backs of what is no sheet any more.
    """
    old = np.zeros(len(scene.triangles), bool) if scene.sheet is None else scene.sheet
    back_of = np.full(len(old), -1, np.int32) if scene.back_of is None else scene.back_of
    owner, front = scene.triangle_surface, back_of < 0
    plain = replace(
        scene,
        back_of=None,
        triangles=np.where(front[:, None], scene.triangles, scene.triangles[:, :1]),
    )
    judged = find_judged(plain) & front
    rows = np.flatnonzero(judged & np.append(asked, False)[owner])
    sheet = old & ~np.isin(np.arange(len(old)), rows)
    if len(rows):
        shapes = shapes_of_scene(plain)
        judge_shapes(shapes, rows[shapes.area[rows] > 0], sheet, lambda share: None)
    backs = np.flatnonzero(~front)
    turned = backs[old[back_of[backs]] & ~sheet[back_of[backs]]]
    scene = remove_triangles(replace(scene, sheet=sheet, back_of=back_of.copy()), turned)
    scene.back_of[turned] = turned  # they are no longer the other side of anything
    fresh = np.flatnonzero(sheet & ~old)
    none = scene.triangles[fresh][:, [0, 2, 1]]
    scene = scene.append_triangles(none, back_of=fresh)
    return (scene if (scene.back_of >= 0).any() else replace(scene, back_of=None)), turned[
        turned < first
    ]


def _order_rows(scene, alive, count, after):
    """Surfaces of the edited city in its order, racks last: (k,) int.

    `alive` are rows before the edit that are still there, `count` how many rows there were.
    """
    rows = np.concatenate([alive, np.arange(count, len(scene.surfaces))])
    racks = rows[np.asarray(scene.surfaces.kind)[rows] == RACK]
    names = _rows_by_polygon(scene.surfaces.surface_id, np.setdiff1d(rows, racks))
    order = [row for name in after.surface_id for row in names.get(name, ())]
    place = {name: k for k, name in enumerate(after.surface_id)}
    roofs = [
        place.get(whole_of_cell(roof_of_rack(scene.surfaces.surface_id[row])), -1) for row in racks
    ]
    return np.concatenate([order, racks[np.argsort(roofs, kind="stable")]]).astype(int)


def _find_twins(scene, order, after, solids, sectors):
    """Judge again, near the change, which surfaces are drawn twice; eligible ones and the report
    of the scene follow, in place. `solids`, (k, 3, 3) [m], are the triangles that went or came.
    """
    boxes = boxes_around(solids)
    local = replace(after, points=scene.site.from_files(after.points))
    low, high = polygon_bounds(*local.shape)
    near, asked = np.zeros((2, len(after)), bool)
    # Polygons near the change are asked; those a bit further off may be their twins.
    for box in boxes:
        near |= (
            (low - 4 * GEOMETRY.uneven <= box[1]) & (high + 4 * GEOMETRY.uneven >= box[0])
        ).all(axis=1)
        asked |= ((low - GEOMETRY.uneven <= box[1]) & (high + GEOMETRY.uneven >= box[0])).all(
            axis=1
        )
    part = local.take(near)
    # Without polygons near the change nothing is judged again.
    if not asked.any():
        return
    # Only this part of the city is searched for polygons drawn twice.
    area, normal = measure_polygons(*part.shape)
    rows = _rows_by_polygon(scene.surfaces.surface_id, order)
    surfaces, twice = scene.surfaces, set(scene.report.repaired.get(DRAWN_TWICE, ()))
    tilt = np.array([surfaces.surface_tilt[rows[name][0]] for name in part.surface_id])
    azimuth = np.array([surfaces.surface_azimuth[rows[name][0]] for name in part.surface_id])
    kind, _, eligible = classify(area, tilt, azimuth, part.thematic, sectors)
    twins = find_twins(part.shape, area, normal, ~np.isin(kind, ("ground", "downward")))
    # Twins are not eligible, and those that are twins no longer may be.
    for k in np.flatnonzero(asked[near]):
        name = part.surface_id[k]
        own = [row for row in rows[name] if surfaces.kind[row] not in (RACK, "ground")]
        surfaces.eligible[own] = eligible[k] & ~twins[k]
        twice = twice | {name} if twins[k] else twice - {name}
    scene.report.repaired.pop(DRAWN_TWICE, None)
    scene.report.repair(DRAWN_TWICE, sorted(twice))
