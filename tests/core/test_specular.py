"""Mirrors, glossy faces and glass in gather: the specular pass against images in mirrors, and
against forward.
"""

from dataclasses import replace

import numpy as np
import pytest
from leaves import box, crowns_of
from mirror_street import (
    EDGES,
    HEIGHT,
    MIDDLE,
    finish,
    light_of_strips,
    lit_share,
    street,
    trace_street,
)
from scenes import assert_mean, join, run_forward, run_gather, run_hybrid, strip, suns_towards
from scipy.special import expn
from test_forward_agrees import SUNS, group_means, refined
from test_tracing import three_houses
from thorough import mark_cases

from citypv.core.light import specular_light, sun_blocks
from citypv.core.patches.brdfs import reflect_interfaces
from citypv.core.patches.materials import MaterialSpec
from citypv.core.settings.errors import InputError

MIRROR = "surface,albedo,material\nfacade,0.6,mirror\nflat,{},\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("estimator", "elevation", "bounces"),
    mark_cases(
        [("gather", 30.0, 1), ("gather", 50.0, 4), ("forward", 30.0, 1), ("forward", 50.0, 1)],
        kept=1,
        law=(2,),
    ),
)
def test_sun_in_a_mirror_facade(tmp_path, estimator, elevation, bounces):
    """The mirror image of the sun lights the street: ρ · sin(elevation) as far as the facade throws
    it.
    """
    fewer = {"samples": 1024} if estimator == "gather" else {}
    transfer = trace_street(
        tmp_path, MIRROR.format(0), elevation, estimator, max_bounces=bounces, **fewer
    )
    mean, error = light_of_strips(transfer, 0)
    assert error.max() < (0.003 if estimator == "gather" else 0.01)
    expected = 0.6 * np.sin(np.radians(elevation)) * lit_share(elevation)
    assert expected[0] > 0.29 and (expected[-1] == 0 or elevation < 45)
    assert_mean(mean, error + 1e-4, expected)
    # Nothing comes back to the facade from a black street, but for the chance by which photons tell
    # of a sun.
    assert transfer.direct_reflected[0, 0] <= (0 if estimator == "gather" else 1e-3)
    assert transfer.visible_share[MIDDLE] == pytest.approx(
        1, abs=0 if estimator == "gather" else 0.05
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("estimator", "material"),
    mark_cases([("gather", "mirror"), ("forward", "mirror"), ("forward", "")], kept=1),
)
def test_sky_in_a_facade(tmp_path, estimator, material):
    """The street sees the sky but for the facade, and in a mirror its image (Hottel), twice what a
    dull one sends.
    """
    near, far = EDGES[:-1], EDGES[1:]
    seen = 0.5 * (1 - (np.hypot(far, HEIGHT) - np.hypot(near, HEIGHT)) / (far - near))
    text = f"surface,albedo,material\nfacade,0.8,{material}\nflat,0,\n"
    mean, error = light_of_strips(trace_street(tmp_path, text, 45.0, estimator))
    assert error.max() < (0.003 if estimator == "gather" else 0.005)
    assert_mean(mean, error + 2e-4, 1 - seen + 0.8 * (1.0 if material else 0.5) * seen)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("estimator", "name", "index", "interfaces"),
    mark_cases(
        [
            ("gather", "glass", 1.52, 2),
            ("forward", "double glazing", 1.52, 4),
            ("gather", "water", 1.333, 1),
        ],
        kept=1,
    ),
)
def test_sun_in_a_glass_facade(tmp_path, estimator, name, index, interfaces):
    """Fresnel's share at the angle of incidence, which is the elevation here."""
    fewer = {"samples": 1024} if estimator == "gather" else {}
    transfer = trace_street(
        tmp_path, f"surface,albedo,material\nfacade,,{name}\nflat,0,\n", 30.0, estimator, **fewer
    )
    mean, error = light_of_strips(transfer, 0)
    share = reflect_interfaces([np.cos(np.radians(30.0))], index, interfaces)[0]
    assert 0.02 < share < 0.2
    assert_mean(mean, error + 1e-4, share * 0.5 * lit_share(30.0))


@pytest.mark.slow
def test_a_mirror_below_a_layer_of_leaves(tmp_path):
    """Leaves take their share on the way to the mirror: e^(-τ/sin β) of a sun, and 2 E₃(τ) of the
    sky.

    A mirror that absorbs nothing shows what it hides: the street is as bright as without it.
    """
    scene, thickness = (
        replace(street(), trees=crowns_of(box([-4000, -4000, 12], [4000, 4000, 14]))),
        0.6,
    )
    path, rays = (
        finish(tmp_path, MIRROR.format(0).replace("0.6", "1")),
        {"samples": 1 << 14, "shadow_samples": 1 << 13},
    )
    settings = {"albedo_file": path, "far_ground": False, "max_bounces": 1, "threads": 1}
    # With an extinction coefficient of 0.5, over 2 m.
    transfer = run_hybrid(
        scene, suns_towards([[0, -(3**0.5), 1]]), leaf_area_density=thickness, **rays, **settings
    )
    sky, sun = light_of_strips(transfer), light_of_strips(transfer, 0)
    assert max(sky[1].max(), sun[1].max()) < 0.01
    assert_mean(sky[0], np.maximum(sky[1], 0.002), 2 * expn(3, thickness))
    assert_mean(sun[0], sun[1] + 2e-4, np.exp(-2 * thickness) * 0.5 * lit_share(30.0))


def trace_houses(tmp_path, finishes, photons, **settings):
    """Three houses with some finishes: the scene; by gather with mirrors, by gather with black
    ones, and by forward.
    """
    scene, path = (
        refined(three_houses(), 10.0),
        finish(tmp_path, f"surface,albedo,material\n{finishes}\n"),
    )
    settings |= {"albedo": 0.5, "ground_albedo": 0.4, "albedo_file": path}
    hybrid = run_hybrid(scene, SUNS, **settings)
    black = run_hybrid(scene, SUNS, effects={"specular": False}, **settings)
    return scene, hybrid, black, run_forward(scene, SUNS, **settings | {"samples": photons})


@pytest.mark.slow
@pytest.mark.parametrize(
    "finishes",
    mark_cases(["facade,0.8,mirror", "facade,0.7,glossy:0.3", "facade,,double glazing"], kept=1),
)
def test_hybrid_is_forward_on_three_houses(tmp_path, finishes):
    """Reflections of all kinds after one another, with far ground."""
    _, *transfers = trace_houses(tmp_path, finishes, 150, samples=128)
    one, without, other = map(group_means, transfers)
    for key, pairs in one.items():
        for (mean, error), (expected, spread) in zip(pairs, other[key], strict=True):
            assert_mean(mean, np.hypot(error, spread) + 1e-6, expected)
            assert error < 0.012
    gain = [one[key][0][0] - without[key][0][0] for key in one]
    assert max(gain) > 0.01


@pytest.mark.slow
def test_stated_errors_of_the_specular_pass_hold():
    """Scatter from seed to seed of what a mirror adds, over what is stated."""
    scene, found = refined(three_houses(), 10.0), []
    scene.surfaces.material = ["panel"] * len(scene.surfaces)
    for seed in range(8):
        settings = {"albedo": 0.0, "ground_albedo": 0.0, "samples": 64, "seed": seed}
        settings["materials"] = {"panel": MaterialSpec(0.9, "mirror")}
        pair = [
            run_hybrid(scene, SUNS, effects={"reflections": True, **more}, **settings)
            for more in ({}, {"specular": False})
        ]
        added = (pair[0].direct_reflected - pair[1].direct_reflected) @ SUNS.weight
        variance, without = (one.direct_annual_standard_error**2 for one in pair)
        found.append((added, np.sqrt(np.maximum(variance - without, 0))))
    added, stated = (np.array(part) for part in zip(*found, strict=True))
    lit = added.mean(axis=0) > 0.01
    assert lit.sum() > 10
    ratio = added[:, lit].std(axis=0, ddof=1) / np.sqrt((stated[:, lit] ** 2).mean(axis=0))
    assert 0.7 < np.median(ratio) < 1.3


@pytest.mark.slow
def test_results_do_not_depend_on_threads_or_on_blocks(tmp_path, monkeypatch):
    path = finish(tmp_path, "surface,albedo,material\nfacade,0.8,mirror\n")
    settings = {"albedo": 0.5, "albedo_file": path, "samples": 64}
    one = run_hybrid(three_houses(), SUNS, threads=1, **settings)
    monkeypatch.setattr(specular_light, "PHOTONS_PER_TASK", 1000)
    monkeypatch.setattr(sun_blocks, "SUNS_PER_BLOCK", 2)
    other = run_hybrid(three_houses(), SUNS, threads=3, **settings)
    for name in ("diffuse_relative", "direct_reflected", "direct_annual_standard_error"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-5, abs=1e-7), name


@pytest.mark.slow
def test_the_plan_and_gather_alone(tmp_path):
    """What calls for the pass, what is said, and that gather never takes a mirror for a black face
    in silence.
    """
    path = finish(tmp_path, MIRROR.format(0.1))
    suns, scene = suns_towards([[0, -1, 1]]), street()
    for settings, on, words in (
        ({"albedo_file": path}, True, "as a mirror"),
        ({"albedo_file": path, "max_bounces": 0}, False, "nothing is reflected"),
        ({"albedo_file": path, "effects": {"specular": False}}, False, "switched off"),
        ({}, False, "every material reflects diffusely"),
    ):
        transfer = run_hybrid(scene, suns, samples=16, **settings)
        effect = next(one for one in transfer.record.effects if one["key"] == "specular")
        assert effect["on"] == on and words in effect["reason"]
    with pytest.raises(InputError, match="use trace_hybrid"):
        run_gather(scene, suns, albedo_file=path)
    dull = {"albedo_file": finish(tmp_path, "surface,material\nfacade,brick\n"), "samples": 16}
    one, other = (run(scene, suns, **dull) for run in (run_hybrid, run_gather))
    assert (one.diffuse_relative == other.diffuse_relative).all()
    assert (one.direct_reflected == other.direct_reflected).all()


@pytest.mark.slow
@pytest.mark.thorough
def test_the_horizon_of_perez_by_way_of_mirrors(tmp_path):
    """The band at the horizon, the second source of Perez's sky, reflected by facades: as forward
    has it.
    """
    scene, hybrid, black, forward = trace_houses(
        tmp_path, "facade,0.8,mirror", 400, samples=256, sky="perez"
    )
    assert set(forward.record.photons) == {"sky", "far ground", "suns", "horizon"}
    tally = forward.record.photons["horizon"]
    assert sum(tally.values()) == 2 * tally["emitted"] > 0
    area = scene.surfaces.area
    for kind in ("facade", "flat"):
        share = np.where(scene.surfaces.kind == kind, area, 0)
        share /= share.sum()
        (one, error), (other, spread), (without, _) = (
            (share @ light.relative, np.sqrt(share**2 @ light.standard_error**2))
            for light in (traced.sources["horizon"] for traced in (hybrid, forward, black))
        )
        assert_mean(one, np.hypot(error, spread), other)
        assert error < 0.01 < one - without


@pytest.mark.slow
def test_the_horizon_of_perez_in_still_water(tmp_path):
    """A level mirror, R wide before a long wall: from height z the band is seen in it down to where
    it ends.

    The lowest z cos φ/R of the band's image, in tangents, are cut off at azimuth φ from the wall's
    normal.
    """
    high, wide, share = 2.0, 20.0, 0.8
    wall = strip([-2000, 0, 0], [4000, 0, 0], [0, 0, high], 1)
    scene = join([wall, strip([-2000, -wide, 0], [4000, 0, 0], [0, wide, 0], 1)])
    path = finish(tmp_path, f"surface,albedo,material\nfacade,0,\nflat,{share},mirror\n")
    height, sine = (np.arange(2000) + 0.5) / 2000 * high, (np.arange(400) + 0.5) / 400
    cut = np.degrees(np.arctan(height[:, None] * np.sqrt(1 - sine**2) / wide)) / 6.5
    expected = share * np.clip(1 - cut, 0, 1).mean()
    settings = {"albedo_file": path, "ground_albedo": 0.0, "max_bounces": 1, "sky": "perez"}
    for run, samples in ((run_hybrid, 1 << 15), (run_forward, 1 << 12)):
        found = run(scene, SUNS, samples=samples, **settings).sources["horizon"]
        error = np.hypot(*found.standard_error[:2]) / 2
        assert_mean(found.relative[:2].mean() - 1, error, expected)
        assert error < 0.02
