"""Modules on the open part of a wall work at the light that it gets, not at the mean with what is
covered.
"""

from dataclasses import replace

import numpy as np
import pvlib
import pytest
from cities import box, make_city
from planes import run_chain
from scenes import run_forward, run_gather, suns_towards
from test_closed_forms import direct_relative
from test_energy import KWP
from thorough import mark_cases
from transfers import unshaded_transfer

import citypv
from citypv.core.energy import compute_energy as module_under_test
from citypv.core.energy.building_power import compute_building_power
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import build_system, dc_system
from citypv.core.run.study import make_located_scene
from citypv.core.settings.request import Request
from citypv.core.sun.sky_grid import sky_grid_suns
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.world.environment import build_environment

COVERED = np.array([0.0, 0.45, 0.2, 0.5])


def cover(transfer, covered, cramped=0.0):
    """The Transfer with parts of its surfaces behind a neighbour, or without room: dark, and in the
    means.
    """
    lit = 1 - covered - cramped
    return replace(
        transfer,
        covered_share=covered,
        no_room=transfer.no_room + np.reshape(cramped, (-1, 1)),
        sky_view_factor=transfer.sky_view_factor * lit,
        far_ground_view_factor=transfer.far_ground_view_factor * lit,
        diffuse_relative=transfer.diffuse_relative * lit,
        visible_share=(transfer.visible_share * lit[:, None]).astype(np.float32),
        direct_reflected=(transfer.direct_reflected * lit[:, None]).astype(np.float32),
    )


@pytest.mark.parametrize("cramped", mark_cases([0.0, COVERED / 3, COVERED], kept=2))
@pytest.mark.parametrize("plain", [True, False])
def test_covered_walls_yield_the_hours_of_their_open_part_by_pvlib(
    berlin, plain, cramped, monkeypatch
):
    """South walls, free, covered, without room: DC and an inverter that clips, by a chain
    of pvlib.
    """
    monkeypatch.setattr(module_under_test, "PLAIN_LIMIT", 1e12 if plain else 0)
    tolerance = 1e-6 if plain else 2e-4
    transfer = unshaded_transfer(choose_suns("days:2", *berlin.axis), [90] * 4, [180] * 4)
    transfer = cover(transfer, COVERED - cramped, cramped)
    transfer.surfaces.area[:] = 100.0
    system = build_system(
        Request(inverter="pvwatts", dc_ac_ratio=1.6, losses=10.0, mounting="open-rack")
    )
    energy = compute_energy(transfer, berlin, system, series=[1])
    poa, dc = run_chain(berlin.data, 90, 180)
    limit = 1 / 1.6 / 0.96  # of the inverter's DC input, over the modules' nominal power
    ac = np.array(pvlib.inverter.pvwatts(0.9 * dc.to_numpy(), limit, 0.96))
    np.testing.assert_allclose(energy.full_load_hours_dc, dc.sum() * (1 - COVERED), rtol=tolerance)
    np.testing.assert_allclose(energy.full_load_hours, ac.sum() * (1 - COVERED), rtol=tolerance)
    np.testing.assert_allclose(
        energy.poa_global_annual, poa.sum() / 1000 * (1 - COVERED), rtol=1e-6
    )
    np.testing.assert_allclose(energy.full_load_hours_by_month.sum(axis=1), energy.full_load_hours)
    # Hour by hour, of a surface, of its group and of its building.
    rest = 1 - COVERED[1]
    np.testing.assert_allclose(energy.series.capacity_factor[:, 0], rest * ac, rtol=1e-2, atol=1e-4)
    np.testing.assert_allclose(
        energy.series.poa_direct + energy.series.poa_diffuse,
        rest * poa.to_numpy()[:, None],
        rtol=1e-6,
    )
    np.testing.assert_allclose(energy.capacity_factor[:, 0], ac, rtol=1e-2, atol=1e-4)
    _, power = compute_building_power(transfer, berlin, energy, system)
    kwp = energy.module_area.sum() / KWP
    np.testing.assert_allclose(power.sum(axis=1), kwp * ac, rtol=1e-2, atol=1e-4 * kwp)


@pytest.mark.parametrize("cramped", [0.0, COVERED])
def test_of_the_world_too(berlin, cramped):
    """An environment of covered walls, or such without room, gives its modules the light of one of
    free walls.
    """
    free = unshaded_transfer(sky_grid_suns(64), [90] * 4, [180] * 4)
    system = dc_system()
    whole, part = (
        build_environment("n", "s", one, system)
        for one in (free, cover(free, COVERED - cramped, cramped))
    )
    for name in ("diffuse", "far_ground", "sky", "visible_share", "reflected"):
        np.testing.assert_allclose(getattr(part.block, name), getattr(whole.block, name), rtol=1e-6)
    assert whole.weight.sum() == pytest.approx(1) and part.weight.sum() == pytest.approx(1)
    np.testing.assert_allclose(part.sources, whole.sources, rtol=1e-6)


def test_surfaces_mostly_without_room_work_at_their_own_light(berlin):
    """Their light is that of the gap before them, and is not taken for light of the little that has
    room.
    """
    free = unshaded_transfer(choose_suns("days:2", *berlin.axis), [90], [180])
    system = build_system(Request(hidden_walls="count"))
    hours = [
        compute_energy(
            replace(free, no_room=np.full((1, 2), share)), berlin, system
        ).full_load_hours
        for share in (0.0, 0.9)
    ]
    np.testing.assert_array_equal(*hours)


def write_blocks(path, *, cut, gap=0.0):
    """A block, and a neighbour at, or a gap before, 9 of 20 m of its south wall: one polygon, or
    cut.
    """
    polygons = box("a", 0, 0, 20, 10, 0, 15) + box("b", 11, -8, 15, 8 - gap, 0, 15)
    parts = [
        [(x, 0, 0), (end, 0, 0), (end, 0, 15), (x, 0, 15)]
        for x, end in ([(0, 11), (11, 20)] if cut else [(0, 20)])
    ]
    south = [("a", "", [part]) for part in parts]
    polygons = [
        one for one in polygons if one[0] == "b" or any(corner[1] for corner in one[2][0])
    ] + south
    lines, count = [], 0
    for building, _, (ring,) in sorted(polygons, key=lambda one: one[0]):
        lines += [f"o {building}"] * (f"o {building}" not in lines) + [
            f"v {x} {y} {z}" for x, y, z in ring
        ]
        lines.append("f " + " ".join(str(count + k + 1) for k in range(len(ring))))
        count += len(ring)
    path.write_text("\n".join(lines) + "\n")
    return path


def south_walls(city):
    """South facades of the building a, as traced with many rays: pandas.DataFrame."""
    place = {"latitude": 52, "longitude": 13, "weather": "clear-sky", "suns": "days:2"}
    rays = {"patch_size": 2.5, "samples": 1024, "shadow_samples": 64, "threads": 1}
    settings = {"inverter": "pvwatts", "layout": "area"}  # every open square metre counts here
    faces = citypv.simulate(city, **settings, **place, **rays).faces
    return faces[
        (faces.building_id == "a")
        & (faces.surface_azimuth.round() == 180)
        & (faces.kind == "facade")
    ]


@pytest.mark.slow
@pytest.mark.parametrize("gap", mark_cases([0.1, 0.0, 0.25], kept=1))
def test_a_wall_yields_the_same_in_one_polygon_and_cut_at_its_neighbour(tmp_path, gap):
    """Energy and light within 0.1 %, with a neighbour at 9 of 20 m of it or a gap before them; its
    rays alone err by less with so many.
    """
    sums = []
    for cut in (False, True):
        wall = south_walls(write_blocks(tmp_path / f"{cut}.obj", cut=cut, gap=gap))
        assert len(wall) == 1 + cut and wall.area.sum() == pytest.approx(300)
        wall = wall[wall.module_area > 0]
        assert len(wall) == 1 and wall.module_area.item() == pytest.approx(165, rel=3e-3)
        names = ["full_load_hours", "full_load_hours_dc", "poa_global_annual"]
        sums.append(wall[names].multiply(wall.area, axis=0).sum().to_numpy())
    np.testing.assert_allclose(sums[0], sums[1], rtol=1e-3)
    # The light of the open part is turned into the same power: what rays leave of noise is in both.
    np.testing.assert_allclose(sums[0][:2] / sums[0][2], sums[1][:2] / sums[1][2], rtol=3e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("clearance", "share"), [(0.3, 0.45), (0.01, 0.0)])
def test_photons_leave_out_the_same_light(clearance, share):
    """A wall of which 9 of 20 m lie 0.25 m behind a neighbour, by rays and by photons, which share
    none; with a clearance below the gap its light counts.
    """
    polygons = box("a", 0, 0, 20, 10, 0, 15) + box("b", 11, -8, 15, 7.75, 0, 15)
    place = {"latitude": 52.0, "longitude": 13.0, "weather": ["clear-sky"]}
    scene = make_located_scene(make_city(polygons), Request(patch_size=2.5, **place))
    suns = suns_towards([[0.2, -0.5, 1], [-0.8, -0.6, 0.3], [-0.9, -0.2, 0.5]])
    settings = {"patch_size": 2.5, "clearance": clearance, "max_bounces": 2}
    found = [
        run_gather(scene, suns, samples=256, shadow_samples=64, **settings),
        run_forward(scene, suns, samples=300, **settings),
    ]
    (wall,) = np.flatnonzero(
        (np.array(scene.surfaces.building_id) == "a") & (scene.surfaces.normal[:, 1] < -0.9)
    )
    light, error = np.array(
        [
            [
                [one.diffuse_relative[wall], direct_relative(one)[wall] @ suns.weight],
                [
                    one.diffuse_relative_standard_error[wall],
                    one.direct_annual_standard_error[wall],
                ],
            ]
            for one in found
        ]
    ).swapaxes(0, 1)
    assert [one.left_out[wall] for one in found] == pytest.approx([share] * 2, abs=2e-3)
    assert (error < 0.004).all()  # the light of the gap is 0.007 and 0.004
    assert (np.abs(light[0] - light[1]) <= 3 * np.hypot(*error)).all()
