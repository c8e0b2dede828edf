"""Which triangles are ground, and what lies on it: footprints, floors at rest, undersides that
hang.

Ground is classified, generated, or an unclassified mesh on which most stands. Whether a building
stands on it follows from its feet (`find_feet`). If not, it may still rest on something, as a tower
does on its podium. Rays go straight down from each triangle: if it rests on something, the next
upward face is close below; if a ray hits a back, the triangle is inside something.
"""

import numpy as np

from ..rays.ray_scene import RayScene
from ..settings.tolerances import GEOMETRY
from .city import number_names
from .join_sheets import UP, join_sheets, look
from .number_sheets import find_yards, number_sheets
from .polygons import normals_of


def find_ground(scene):
    """Triangles of the ground.

    Many meshes have no classes. Of such a mesh the faces that point up are the ground, if they are
    all of it or no walls hang from their rim (`number_sheets`), if they cover at least half of the
    city's bounds, and most of what the others show to the side and upwards stands above them: of a
    roof drawn by itself, or the deck of a podium, the walls of its own house stand below it or
    beside it. Several that meet (`join_sheets`) count as one, so that pavements, lawns and squares
    may be objects of their own, or tiles hold their own houses.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    (t,) bool
    """
    scene.check()
    # Surfaces that are classified as ground, and what is generated, count at once.
    surface = scene.triangle_surface
    # -1, generated ground, takes the last
    named = np.append(np.asarray(scene.surfaces.kind) == "ground", True)
    ground = named[scene.surface_of_triangle] & ~scene.footprint
    building = np.append(number_names(scene.surfaces.building_id), -1)[surface]
    vertices, triangles, own = np.asarray(scene.vertices, float), scene.triangles, building >= 0
    # Without surfaces only what was generated is ground.
    if not own.any():
        return ground
    # Twice the plan area, and the rectangle around all buildings [m²].
    upward, inside = upward_areas(vertices, triangles), np.zeros(len(vertices), bool)
    inside[triangles[own]] = True
    whole = np.ptp(vertices[inside, :2], axis=0).prod()
    # Candidates are meshes without classes that face up with more than twice the area with which
    # they face down. What has an underside is a slab; houses joined with ground have one where they
    # stand.
    classes = np.append(np.asarray(scene.surfaces.thematic, str) != "", True)[surface]
    rising, sinking = (
        np.bincount(building[own], np.maximum(sign * upward[own], 0)) for sign in (1, -1)
    )
    candidate = np.append(2 * sinking < rising, False)
    candidate[building[own & (classes | ground)]] = False
    mesh = np.where(candidate[building], building, -1)
    # Where all such meshes together cover less than half of the city's bounds, none is the ground.
    enough = max(0.5 * whole, 1e-12)
    if upward[(mesh >= 0) & (upward > 0)].sum() / 2 < enough:
        return ground
    # Candidates are cut into sheets that hang together. Where these cover too little, none is the
    # ground; else they are joined with others that they meet, and each group and each lone sheet is
    # asked whether it covers enough.
    sheet, alone = number_sheets(vertices, triangles, upward > 0, mesh)
    some = np.flatnonzero(sheet >= 0)
    spanned = np.bincount(sheet[some], upward[some] / 2, len(alone))
    if spanned.sum() < enough:
        return ground
    group = join_sheets(vertices, triangles[some], sheet[some], triangles)
    for number in (group, np.where(alone, np.arange(len(alone)), -1)):
        area = np.bincount(number + 1, spanned)[1:]
        for one in np.flatnonzero(area >= enough):
            members = np.append(number == one, False)
            chosen = members[sheet]
            # What is ground already is not asked again.
            if ground[chosen].all():
                continue
            # Where houses share corners with the ground, it has yards, and there is none below
            # their roofs.
            mixed = not alone[members[:-1]].all()
            if mixed:
                chosen = find_yards(
                    vertices, triangles, np.where(np.append(alone, True)[sheet], -1, sheet), chosen
                )
            # It is the ground if most of what the others show stands above it.
            others = vertices[triangles[own & ~chosen]]
            if _carries_most(vertices, triangles[chosen], others, steep=mixed):
                ground |= chosen
    return ground


def _carries_most(vertices, sheet, corners, *, steep=False):
    """Whether most of the area of some faces has a mesh straight below the place before its middle.

    Parameters
    ----------
    vertices : (v, 3) float64 [m]
    sheet : (k, 3) int
        Triangles of the mesh.
    corners : (t, 3, 3) float64 [m]
        The faces; those that face down, as floors and undersides, do not count.
    steep : bool
        Whether only faces steeper than 60° count.
    """
    # Faces that show to the side or upwards; 2 * area is of no matter where shares are compared.
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    shown = (area > 0) & (normal[:, 2] > -GEOMETRY.upright * area)
    if steep:
        shown &= normal[:, 2] < 0.5 * area
    corners, normal, area = corners[shown], normal[shown], area[shown]
    # The place to ask what lies below stands a step before the face.
    places = corners.mean(axis=1) + GEOMETRY.step * normal / area[:, None]
    above = height_below(vertices, sheet, places, places[:, 2]) > -np.inf
    return 2 * area[above].sum() > area.sum()


def height_below(vertices, triangles, points, start):
    """Height of the first triangle below a starting height at the position of each point.

    Parameters
    ----------
    vertices : (v, 3) float64 [m]
    triangles : (k, 3) int
    points : (n, 3) float64 [m]
    start : (n,) float64 [m]

    Returns
    -------
    (n,) float64 [m]
        -inf if there is none.
    """
    return (
        start
        - look(
            np.asarray(vertices, float), triangles, np.column_stack([points[:, :2], start]), -UP
        ).distance
    )


def find_hanging(scene, floating):
    """Footprints that receive light from below.

    Parameters
    ----------
    scene : Scene
        Including its ground.
    floating : (h,) int
        Surfaces that are footprints but have no foot on the ground.

    Returns
    -------
    (t,) bool
        Of all triangles. Only footprints without a foot may hang; one that something carries, or
        whose underside lies inside a body, does not.
    """
    hanging = np.zeros(len(scene.triangles), bool)
    rows = np.flatnonzero(
        scene.footprint & (scene.triangle_surface >= 0) & np.isin(scene.triangle_surface, floating)
    )
    if not len(rows):
        return hanging
    # Footprints without a foot on the ground, what may carry them (all that faces up), and the
    # height of their building.
    corners = np.asarray(scene.vertices, float)[scene.triangles[rows]]
    upward = upward_areas(scene.vertices, scene.triangles)
    carriers, whole = scene.triangles[upward > 0], RayScene(scene.vertices, scene.triangles)
    slack = _rounding_of(corners)
    own, building = scene.triangle_surface >= 0, number_names(scene.surfaces.building_id)
    top = np.full(building.max(initial=-1) + 1, -np.inf)  # of each building
    height = np.asarray(scene.vertices, float)[:, 2]
    np.maximum.at(
        top, building[scene.triangle_surface[own]], height[scene.triangles[own]].max(axis=1)
    )
    # above  height of the building over the footprint [m]: it may hang by no more and count as
    # resting.
    above = top[building[scene.triangle_surface[rows]]] - corners[..., 2].min(axis=1)
    # A resting face is drawn up to a step above what carries it.
    near = np.clip(above, GEOMETRY.accuracy, GEOMETRY.step)
    down = np.tile(np.float32([0, 0, -1]), (len(rows), 1))
    votes = np.zeros(len(rows), int)
    for turn in range(3):
        # Barycentric places of ray origins: seldom above an edge, hardly ever two of three.
        place = np.einsum("c,rcx->rx", np.roll((0.55, 0.27, 0.18), turn), corners)
        # Light from below: nothing that carries is near under the place, and it is not inside
        # anything: the first face under it is no footprint and does not face down. Two of three
        # places decide.
        clear = (
            place[:, 2] - height_below(scene.vertices, carriers, place, place[:, 2] + slack) > near
        )
        place[:, 2] -= np.maximum(slack, GEOMETRY.corner)
        met = whole.trace_closest(place.astype(np.float32), down)
        votes += clear & ~((met >= 0) & (scene.footprint[met] | (upward[met] < 0)))
    hanging[rows[votes >= 2]] = True
    return hanging


def _rounding_of(corners):
    """How far float32 may move the corners of triangles, (t, 3, 3) [m]: (t,) [m]."""
    return GEOMETRY.spacings * np.finfo(np.float32).eps * np.abs(corners).max(axis=(1, 2))


def upward_areas(vertices, triangles):
    """Twice the plan area of triangles, (t,), negative for those that face down; 0 for walls."""
    normal = normals_of(np.asarray(vertices, float), triangles)
    steepest = GEOMETRY.upright * np.linalg.norm(normal, axis=1)
    return np.where(np.abs(normal[:, 2]) > steepest, normal[:, 2], 0.0)


def find_resting_floors(scene, ground=None):
    """Footprints, and triangles that face downwards at or below the ground or rest on another
    surface.

    A footprint counts as a back from both sides: nothing can pass light to it, so it receives none.
    The ground has no thickness, so a ray that starts under it would hit nothing. Triangles under it
    are found by vertical rays down to the ground from above each triangle's middle. Triangles that
    rest on anything facing up, such as a roof or ground that is not classified as such, are found
    by rays down from the middle itself.

    Parameters
    ----------
    scene : Scene
    ground : (t,) bool, optional
        Result of `find_ground`, if already known.

    Returns
    -------
    (t,) bool
    """
    scene.check()
    upward = upward_areas(scene.vertices, scene.triangles)
    downward = np.flatnonzero((upward < 0) & (scene.triangle_surface >= 0))
    buried = scene.footprint.copy()
    if not len(downward):
        return buried
    # At or below the ground: its height straight under, or over, the middle.
    corners = np.asarray(scene.vertices, float)[scene.triangles[downward]]
    middle = corners.mean(axis=1)
    ground = find_ground(scene) if ground is None else ground
    if ground.any():
        highest = np.full(len(middle), scene.vertices[:, 2].max() + 1)
        height = height_below(scene.vertices, scene.triangles[ground], middle, highest)
        buried[downward] |= middle[:, 2] <= height + GEOMETRY.accuracy
    # Start above the middle, which rounding may have put below the face that it rests on.
    slack = _rounding_of(corners)
    # Resting on anything else that faces up: no gap below the middle.
    carries = upward > 0
    if scene.back_of is not None:
        carries &= scene.back_of < 0  # nothing rests on its own back
    height = height_below(scene.vertices, scene.triangles[carries], middle, middle[:, 2] + slack)
    buried[downward] |= middle[:, 2] <= height + GEOMETRY.accuracy
    return buried
