"""A second source of light in the sky, added as `sky/light_sources.py` says: a ring, from rays to full load hours.

Everything below but the tests is what a new source needs: its SkySource, an entry in SOURCES, and a sky that has it.
"""

from dataclasses import replace

import numpy as np
import pytest
from mirror_street import finish
from scenes import assert_mean, suns_towards
from test_forward_agrees import SUNS, refined
from test_sky import open_plane
from test_tracing import three_houses

from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import build_system
from citypv.core.errors import InputError
from citypv.core.light.merge_transfers import merge_transfers
from citypv.core.light.trace_gather import trace_gather
from citypv.core.photons.specular_light import trace_hybrid
from citypv.core.photons.trace_forward import trace_forward
from citypv.core.progress import silent
from citypv.core.request import Request
from citypv.core.results.read_transfer import read_transfer
from citypv.core.results.write_transfer import write_transfer
from citypv.core.sky import light_sources, sky_models
from citypv.core.sky.perez_sky import perez_sky
from citypv.core.sky.sky_source import SkySource
from citypv.core.sun.sky_grid import sky_grid_suns
from citypv.core.weather.read_weather import read_weather
from citypv.core.world.compute_world import compute_world
from citypv.core.world.environment import build_environment
from citypv.core.world.sources import station_source
from citypv.core.world.unshaded import unshaded_transfer

LOW, HIGH = np.radians([30.0, 45.0])  # elevations between which the ring is bright
AREA = np.sin(HIGH) ** 2 - np.sin(LOW) ** 2  # of the ring, projected onto the ground, over π
STEPS = 400
ELEVATION = LOW + (np.arange(STEPS) + 0.5) * (HIGH - LOW) / STEPS
WALL = float((np.cos(ELEVATION) ** 2).sum() * 2 / np.pi / AREA * (HIGH - LOW) / STEPS)  # light of a wall


def by_elevation(normal):
    """Light of unshaded planes from each elevation of the ring, integrated over azimuth: (n, STEPS)."""
    level = np.hypot(normal[:, 0], normal[:, 1])[:, None] * np.cos(ELEVATION)
    upward = np.asarray(normal, float)[:, 2:] * np.sin(ELEVATION)
    half = np.arccos(np.clip(-upward / np.maximum(level, 1e-12), -1, 1))  # of the azimuths in front
    light = 2 * (level * np.sin(half) + upward * half)
    return light * np.cos(ELEVATION) * (HIGH - LOW) / STEPS / np.pi / AREA


def ring_of_tilt(normal):
    return by_elevation(normal).sum(axis=1)


def ring_directions(normal, along, up):
    """Elevations by their light, then azimuths by the cosine of incidence."""
    light = by_elevation(normal)
    bounds = np.cumsum(light, axis=1) / light.sum(axis=1, keepdims=True)
    step = np.stack([np.searchsorted(row, numbers) for row, numbers in zip(bounds, up, strict=True)])
    elevation = ELEVATION[np.minimum(step, STEPS - 1)]
    level = np.hypot(normal[:, :1], normal[:, 1:2]) * np.cos(elevation)
    upward = normal[:, 2:] * np.sin(elevation)
    half = np.arccos(np.clip(-upward / np.maximum(level, 1e-12), -1, 1))
    low, high = -half, half.copy()
    for _ in range(50):  # the inverse of level · sin φ + upward · φ
        middle = (low + high) / 2
        passed = level * np.sin(middle) + upward * middle
        whole = level * np.sin(half) + upward * half
        above = passed > (2 * along - 1) * whole
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    turn = np.arctan2(normal[:, 1:2], normal[:, :1]) + low
    return np.stack([np.cos(elevation) * np.cos(turn), np.cos(elevation) * np.sin(turn), np.sin(elevation)], -1).astype(
        "f4"
    )


def ring_inwards(axis, sign, numbers):
    lid, turn = axis == 2, 2 * np.pi * numbers[:, 0]
    through_lid = np.arcsin(np.sqrt(np.sin(LOW) ** 2 + AREA * numbers[:, 1]))
    share = np.cumsum(np.cos(ELEVATION) ** 2)
    elevation = np.where(lid, through_lid, np.interp(numbers[:, 1] * share[-1], share, ELEVATION))
    across = np.where(lid, np.sin(turn), 2 * numbers[:, 0] - 1)
    along = np.where(lid, np.cos(turn), sign * np.sqrt(1 - across**2))
    x, y = np.where(axis == 1, across, along), np.where(axis == 1, along, across)
    return np.stack([np.cos(elevation) * x, np.cos(elevation) * y, -np.sin(elevation)], axis=1)


RING = SkySource(
    name="ring",
    title="the ring",
    unit="that of unshaded level ground",
    skies=("perez",),
    stream=np.uint64(0x5115),
    incidence="sky",
    unshaded=ring_of_tilt,
    sample=ring_directions,
    seen=lambda normal, terrain: np.ones(len(normal)),
    contains=lambda directions: (directions[:, 2] > np.sin(LOW)) & (directions[:, 2] < np.sin(HIGH)),
    radiance=1 / AREA,
    low=0.0,
    sides=np.array([1, 0, WALL, WALL, WALL, WALL]),
    enter=ring_inwards,
    weigh=lambda normal, towards: np.ones(len(normal)),
)


def ringed_sky(weather):
    """Perez's, with 0.3 of the dome's light in the ring."""
    parts = perez_sky(weather)
    light = {"ring": 0.3 * parts["dome"], **parts["sources"]}
    return parts | {"dome": 0.7 * parts["dome"], "sources": light}


@pytest.fixture(autouse=True)
def ring(monkeypatch):
    monkeypatch.setitem(light_sources.SOURCES, "ring", RING)
    monkeypatch.setitem(sky_models.MODELS, "perez", ringed_sky)


@pytest.mark.parametrize("tilt", [0, 20, 40, 70, 90, 115])
def test_rays_and_photons_of_the_ring_on_an_open_plane(tilt):
    """Against the integral over its azimuths and elevations: cos(tilt) where all of it is in front."""
    scene, suns = open_plane(tilt, 200), suns_towards([[0.3, 0.2, 1.0]])
    expected = np.cos(np.radians(tilt)) if tilt < 30 else ring_of_tilt(scene.surfaces.normal)[0]
    request = Request(sky="perez", far_ground=False, effects={"sky-rays": True, "shadow-rays": True})
    by_rays = trace_gather(scene, suns, request, silent)
    assert by_rays.sources["ring"].view_factor[0] == pytest.approx(expected, rel=1e-5)
    assert by_rays.record.source_rays == {"horizon": 64 * (tilt > 0), "ring": 64}
    known = trace_gather(scene, suns, replace(request, effects={}), silent)
    assert known.sources["ring"].relative[0] == pytest.approx(expected, rel=1e-6)
    forward = trace_forward(scene, suns, replace(request, effects={}, samples=100_000), silent).sources["ring"]
    assert forward.standard_error[0] < 0.02
    assert_mean(forward.relative, forward.standard_error, expected)


@pytest.mark.once
def test_the_ring_in_a_street_with_mirrors_is_that_of_photons(tmp_path):
    """Reflections of all kinds, and the ring's light by way of mirrors, in gather and in forward."""
    scene = refined(three_houses(), 10.0)
    path = finish(tmp_path, "surface,albedo,material\nfacade,0.8,mirror\n")
    settings = Request(albedo=0.5, ground_albedo=0.4, albedo_file=path, samples=256, sky="perez")
    hybrid = trace_hybrid(scene, SUNS, settings, silent)
    forward = trace_forward(scene, SUNS, replace(settings, estimator="forward", samples=400), silent)
    assert set(forward.record.photons) == {"sky", "far ground", "suns", "horizon", "ring"}
    for kind in ("facade", "flat"):
        share = (
            np.where(scene.surfaces.kind == kind, scene.surfaces.area, 0)
            / scene.surfaces.area[scene.surfaces.kind == kind].sum()
        )
        for name in ("ring", "horizon"):
            one, other = (traced.sources[name] for traced in (hybrid, forward))
            error = np.sqrt(share**2 @ (one.standard_error**2 + other.standard_error**2))
            assert error < 0.02
            assert_mean(share @ one.relative, error, share @ other.relative)


def test_the_ring_goes_through_files_and_rounds(tmp_path):
    scene = open_plane(35, 200)
    request = Request(sky="perez", effects={"sky-rays": True})
    rounds = [trace_gather(scene, SUNS, replace(request, seed=seed), silent) for seed in (0, 1)]
    merged = merge_transfers(rounds)
    assert merged.record.source_rays == {"horizon": 128, "ring": 128}
    write_transfer(tmp_path / "transfer.nc", merged)
    again = read_transfer(tmp_path / "transfer.nc")
    assert again.record.source_rays == merged.record.source_rays
    assert list(again.sources) == ["horizon", "ring"]
    for name, values in vars(merged.sources["ring"]).items():
        np.testing.assert_array_equal(getattr(again.sources["ring"], name), values)


@pytest.mark.once
def test_irradiation_is_that_of_all_parts_of_the_sky():
    """Unshaded planes: DNI and circumsolar light, dome, horizon and ring, each in closed form; world as yield."""
    transfer, system = unshaded_transfer(), build_system(Request(diffuse_iam=True))
    weather = read_weather("clear-sky", 52.5, 13.4, 34.0)
    found = compute_energy(transfer, weather, system, threads=1, sky="perez")
    parts, normal = sky_models.split_sky(weather, "perez"), transfer.surfaces.normal
    assert list(parts.sources) == ["horizon", "ring"]
    bare = replace(transfer, sources={"ring": transfer.sources["ring"]})
    with pytest.raises(InputError, match="without the light of the horizon;"):
        compute_energy(bare, weather, system, sky="perez")
    none = {
        name: replace(light, view_factor=0 * light.relative, relative=0 * light.relative)
        for name, light in transfer.sources.items()
    }
    without = compute_energy(replace(transfer, sources=none), weather, system, threads=1, sky="perez")
    gained = (found.poa_global_annual - without.poa_global_annual) * 1000
    expected = parts.sources["ring"].sum() * ring_of_tilt(normal)
    expected += parts.sources["horizon"].sum() * np.hypot(*normal[:, :2].T)
    np.testing.assert_allclose(gained, expected, rtol=1e-3)

    environment = build_environment("open", "closed form", transfer, system, "perez")
    world = compute_world([environment], station_source([weather], ["here"]), system, threads=1, sky="perez")
    expected = found.capacity_factor.sum(axis=0) / found.years
    np.testing.assert_allclose(world.full_load_hours[0, 0, :, 0], expected, rtol=1e-4)
    assert transfer.suns.way == sky_grid_suns(len(transfer.suns)).way
