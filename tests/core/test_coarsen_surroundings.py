"""Coarser triangles far from a tile: what stays, how far corners move, and what is hidden from the tile."""

import json

import numpy as np
import pytest
from small_city import HEAD, house
from weathers import ERA5

from citypv.__main__ import main
from citypv.core.cluster.coarsen_surroundings import WIDTH, coarsen, heights
from citypv.core.rays.ray_scene import RayScene
from citypv.core.results.read_transfer import read_transfer

TILE = np.array([[-20.0, -20.0, 0.0], [20.0, -20.0, 0.0], [0.0, 20.0, 10.0]])


def block(low, high, step):
    """A closed box of triangles with sides of `step` [m], seen from outside counter-clockwise: vertices, triangles."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    vertices, triangles = [], []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side, end in enumerate((low, high)):
            counts = [round((high[k] - low[k]) / step) for k in (u, v)]
            a, b = np.meshgrid(*(np.linspace(low[k], high[k], n + 1) for k, n in zip((u, v), counts, strict=True)))
            points = np.empty((a.size, 3))
            points[:, axis], points[:, u], points[:, v] = end[axis], a.ravel(), b.ravel()
            row = np.arange(a.size).reshape(a.shape)
            p, q, r, s = (part.ravel() for part in (row[:-1, :-1], row[:-1, 1:], row[1:, 1:], row[1:, :-1]))
            faces = np.concatenate([np.column_stack([p, q, r]), np.column_stack([p, r, s])])
            triangles.append((faces if side else faces[:, ::-1]) + sum(map(len, vertices)))
            vertices.append(points)
    return np.concatenate(vertices), np.concatenate(triangles)


def with_tile(vertices, triangles):
    """The tile's own triangle before some others: vertices, triangles, own."""
    own = np.arange(len(triangles) + 1) == 0
    return np.concatenate([TILE, vertices]), np.concatenate([[[0, 1, 2]], triangles + 3]), own


def test_what_is_near_or_has_corners_of_its_own_stays_to_the_last_bit():
    near = block((40, -20, 0), (80, 20, 30), 2.0)  # cells below 1 m
    far = block((1000, -300, 0), (1300, 300, 90), 30.0)  # of which no two corners share a cell
    vertices, triangles, own = with_tile(
        np.concatenate([near[0], far[0]]), np.concatenate([near[1], far[1] + len(near[0])])
    )
    found, faces, kept, moved = coarsen(vertices, triangles, own, own)
    assert not moved.any()
    assert np.array_equal(kept, np.arange(len(triangles)))
    assert found[faces].tobytes() == vertices[triangles].tobytes()


def test_corners_move_by_less_than_their_cell_and_blocks_stay_closed():
    vertices, triangles, own = with_tile(*block((1200, -100, 0), (1260, 100, 150), 3.0))
    found, faces, kept, moved = coarsen(vertices, triangles, own, own)
    assert len(faces) < len(triangles) / 4
    assert moved[1:].all()
    assert (np.diff(kept) > 0).all()
    # Every corner that is left lies close to one of each of its triangle's.
    apart = np.linalg.norm(found[faces][:, :, None] - vertices[triangles[kept]][:, None], axis=3).min(axis=2)
    assert apart.max() < np.sqrt(3) * WIDTH * 1260
    assert heights(found[faces]).min() > 1e-3
    corners = found[faces[1:]]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    assert np.abs(area.sum(axis=0)).max() < 1e-6 * np.linalg.norm(area, axis=1).sum()  # closed
    volume = np.einsum("ij,ij->", corners.mean(axis=1), area) / 3
    assert volume == pytest.approx(60 * 200 * 150, rel=0.1)


def test_triangles_that_must_stay_keep_their_corners():
    vertices, triangles, own = with_tile(*block((1200, -100, 0), (1260, 100, 150), 3.0))
    mirror = own | (vertices[triangles][:, :, 0].max(axis=1) <= 1200)  # the front, and the tile
    found, faces, kept, _ = coarsen(vertices, triangles, own, mirror)
    chosen = np.flatnonzero(mirror[kept])
    assert len(chosen) == mirror.sum()
    assert found[faces[chosen]].tobytes() == vertices[triangles[mirror]].tobytes()


@pytest.mark.parametrize(("distance", "step"), [(300.0, 1.0), (1200.0, 3.0), (4000.0, 10.0)])
def test_a_distant_block_hides_what_it_did_but_for_the_sun_s_disc(distance, step):
    """Against the box itself, ray by ray (slabs): no ray further from its outline than the sun is wide differs, and
    what it hides of a fan of rays around it stays the same within 0.3 %."""
    wide, tall = distance / 6, distance / 6
    low, high = np.array([distance, -wide, 0.0]), np.array([distance + wide, wide, tall])
    vertices, triangles, own = with_tile(*block(low, high, step))
    found, faces, _, moved = coarsen(vertices, triangles, own, own)
    assert moved.any()
    tree = RayScene(found, faces[1:])
    across, up = np.meshgrid(np.linspace(-0.3, 0.3, 300), np.linspace(0.02, 0.3, 141))
    directions = np.column_stack([np.ones(across.size), across.ravel(), up.ravel()])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origin = np.array([0.0, 0.0, 1.5])
    hit = tree.trace_closest(np.tile(np.float32(origin), (len(directions), 1)), directions.astype(np.float32)) >= 0
    width = np.sqrt(3) * WIDTH * np.linalg.norm(high)
    assert not hit[~meets_box(origin, directions, low - width, high + width)].any()
    assert hit[meets_box(origin, directions, low + width, high - width)].all()
    assert hit.sum() == pytest.approx(meets_box(origin, directions, low, high).sum(), rel=0.003)


def meets_box(origin, directions, low, high):
    """Whether rays meet a box: the slab test, (m,) bool."""
    one, other = (low - origin) / directions, (high - origin) / directions
    return np.maximum.reduce(np.minimum(one, other), axis=1) <= np.minimum.reduce(np.maximum(one, other), axis=1)


def test_a_tile_without_triangles_leaves_all_as_it_is():
    vertices, triangles = block((1000, 0, 0), (1010, 10, 10), 2.0)
    none = np.zeros(len(triangles), bool)
    found, faces, kept, moved = coarsen(vertices, triangles, none, none)
    assert np.array_equal(found[faces], vertices[triangles])
    assert len(kept) == len(triangles)
    assert not moved.any()


@pytest.mark.once
def test_a_coarser_tower_shades_within_the_bound(tmp_path):
    """A house, and a tower of 120 m half a kilometre south of it in patches of 3 m, in tiles and as a whole."""
    city = tmp_path / "tower.gml"
    houses = house("a", (0, 0), (10, 9, 7)) + house("tower", (-10, -500), (30, 30, 120))
    city.write_text(f"{HEAD}{houses}</CityModel>\n", encoding="utf-8")
    settings = ["--weather", str(ERA5), "--suns", "days:12", "--samples", "256", "--shadow-samples", "4"]
    settings += ["--max-bounces", "1", "--threads", "1", "--patch-size", "3", "--quiet"]
    found = []
    for name, more in (("whole", []), ("tiles", ["--cluster", "serial", "--tile", "100"])):
        assert main(["simulate", str(city), "--out", str(tmp_path / name), *settings, *more]) == 0
        found.append(read_transfer(tmp_path / name / "transfer.nc"))
    told = json.loads((tmp_path / "tiles" / "summary.json").read_text(encoding="utf-8"))["tiles"]
    whole, tiles = found
    own = np.flatnonzero(whole.surfaces.eligible)  # of both: the tower sees no more than the house, which is small
    area = whole.surfaces.area[own]
    assert not np.array_equal(tiles.sky_view_factor, whole.sky_view_factor)  # corners have moved
    skies = [area @ one.sky_view_factor[own] / area.sum() for one in found]
    assert 0 < abs(skies[1] - skies[0]) <= told["left_out"]["edges"] < 1e-4
    assert told["bound"] < 1.0
    shares = [one.visible_share[own] @ one.suns.weight for one in found]
    assert np.abs(shares[1] - shares[0]).max() < 0.01
