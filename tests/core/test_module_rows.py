"""Modules in rows: counted by hand on simple shapes; never outside, never overlapping, and no fewer
than brute force finds.
"""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from citypv.core.modules.lay_modules import Planes, lay_modules

SIZE = 1.6, 1.0  # [m] length, width
GAP = 0.02


def lay(*shapes, kind="roof", size=SIZE, boxes=None):
    """Modules on polygons in the plane of x and y."""
    count = len(shapes)
    axes = (np.tile(axis, (count, 1)) for axis in np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]))
    return lay_modules(np.array(shapes, object), Planes(*axes), [kind] * count, size, boxes=boxes)


def draw(layout):
    low = layout.corner[:, :2]
    return shapely.box(*low.T, *(low + (layout.along + layout.up)[:, :2]).T)


# shape, kind, and modules by hand: columns × rows of the better format
BY_HAND = {
    # 10 × 5 m, 0.3 m from the edges: 9.4 × 4.4 m. Upright 9 of 1.02 in 9.42, 2 rows of 1.62 in
    # 4.42: 18. Lying 5 of 1.62 in 9.42, 4 rows of 1.02 in 4.42: 20.
    "gable's side": (shapely.box(0, 0, 10, 5), "roof", 20),
    # 4.6 × 2.2 m: within the edges 4.0 × 1.6 m: upright 3 × 1, lying 2 × 1.
    "one row": (shapely.box(0, 0, 4.6, 2.2), "roof", 3),
    # 1.2 m wide, 12 m high wall: 1.0 × 11.8 m: upright 1 × 7, lying none.
    "narrow wall": (shapely.box(0, 0, 1.2, 12), "facade", 7),
    "wall too narrow": (shapely.box(0, 0, 1.19, 12), "facade", 0),
    # 10.6 × 10.6 with a dormer of 4.4 m cut out of the lower middle: left and right 3.1 m less
    # 0.6 m; by rows below: 2.5 m wide, 2 upright or 1 lying each; above the dormer 10.0 m wide.
    # Dormer from 0 to 5.0 m: below 5.3 m rows of 2 + 2; above, 5.3 to 10.3: upright 3 rows of 9,
    # beginning at 5.44 at the latest; below 3 rows (0.3 to 5.16) of 4: 12 + 27 = 39. Lying: rows
    # of 1.02: 4 below (0.3 to 4.38) of 2, the fifth from 4.38 of 2 to 5.4, 4 above of 6: 34.
    "dormer cut out": (
        shapely.box(0, 0, 10.6, 10.6) - shapely.box(3.1, 0, 7.5, 5.0),
        "roof",
        39,
    ),
}


@pytest.mark.parametrize("name", BY_HAND)
def test_counts_by_hand(name):
    shape, kind, count = BY_HAND[name]
    assert len(lay(shape, kind=kind)) == count


def test_windows_leave_their_bands():
    """A wall of 10 × 9 m, windows from 1.6 to 3 m of each storey, the lowest kept free: rows at 3
    and 6 m.
    """
    bands = np.array([[-99, -1, 99, 3.0], [-99, 4.6, 99, 6.0], [-99, 7.6, 99, 9.0]])
    layout = lay(shapely.box(0, 0, 10, 9), kind="facade", boxes=[bands])
    assert len(layout) == 2 * 9  # 9.8 m: 9 upright of 1.02, 6 lying
    np.testing.assert_allclose(np.unique(layout.corner[:, 1]), [3, 6])


def test_flat_roofs_have_paths():
    """20 × 6.86 m, 0.5 m from the edges, 5.86 m: two rows of 1.6, 0.6 m, one of 1.6, less 0.04."""
    layout = lay(shapely.box(0, 0, 20, 6.86), kind="flat")
    rows = np.unique(layout.corner[:, 1])
    assert len(layout) == len(rows) * (18 if layout.along[0, 0] == 1.0 else 11)
    height = layout.up[0, 1]
    distances = np.diff(rows) - height
    assert np.all(distances >= GAP - 1e-6)
    assert np.all(distances[:-1] + distances[1:] >= GAP + 0.6 - 1e-6)


def test_the_paths_of_two_parts_of_a_flat_roof_begin_anew():
    """0.5 m from the edges 4 × 1.7 m, and 4.3 m above it 4 × 3.4 m: there two upright rows fit with
    a gap, none with a path, after the one below: 3 + 2 × 3.
    """
    parts = shapely.union(shapely.box(0, 0, 5, 2.7), shapely.box(0, 6, 5, 10.4))
    layout = lay(parts, kind="flat")
    assert len(layout) == 9
    inset = parts.buffer(-0.5, join_style="mitre")
    assert all(inset.buffer(2e-4).covers(module) for module in draw(layout))
    np.testing.assert_array_equal(layout.row, np.repeat([0, 1, 2], 3))


@st.composite
def polygons(draw_number):
    """Stars around a middle, some with a hole."""
    count = draw_number(st.integers(3, 9))
    radii = [draw_number(st.floats(1.5, 7.0)) for _ in range(count)]
    angles = 2 * np.pi * np.arange(count) / count + draw_number(st.floats(0, 1))
    shape = shapely.Polygon(np.column_stack([radii * np.cos(angles), radii * np.sin(angles)]))
    if draw_number(st.booleans()):
        shape = shape - shapely.box(-0.6, -0.3, 0.4, 0.8)
    return shape


@pytest.mark.slow
@given(polygons())
@settings(max_examples=60, deadline=None, derandomize=True)
def test_modules_stay_inside_apart_and_are_no_fewer_than_by_brute_force(shape):
    layout = lay(shape)
    modules, inset = draw(layout), shape.buffer(-0.3, join_style="mitre", mitre_limit=2.0)
    assert all(inset.buffer(2e-4).covers(module) for module in modules)
    assert shapely.area(shapely.union_all(modules)) == pytest.approx(len(layout) * 1.6)
    near, other = shapely.STRtree(modules).query(modules, "dwithin", distance=GAP - 2e-4)
    assert (near == other).all()
    assert len(layout) >= max(_count_by_lattice(inset, *size) for size in (SIZE, SIZE[::-1]))


def _count_by_lattice(inset, width, height, steps=8):
    """Most modules that any regular lattice of rows holds, each of which begins anywhere: by trying
    each eighth of a module.
    """
    if inset.is_empty:
        return 0
    left, bottom, right, top = inset.bounds
    counts = []
    for low in bottom + (height + GAP) / steps * np.arange(steps):
        lows, total = np.arange(low, top, height + GAP), 0
        for row in lows:
            starts = left + (width + GAP) / steps * np.arange(steps)
            lattices = [np.arange(start, right, width + GAP) for start in starts]
            total += max(
                int(shapely.covers(inset, shapely.box(x, row, x + width, row + height)).sum())
                for x in lattices
            )
        counts.append(total)
    return max(counts)
