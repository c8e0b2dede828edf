"""Hard edits of a city, from its border to its courtyards, and the errors of what an edit
changes.
"""

from dataclasses import replace

import numpy as np
import pytest
from cities import box, make_city
from test_edit_light import REQUEST, annual_light, check_law, make, trace_wholly
from thorough import mark_cases

from citypv.core.city.edit_city import CityChange, edit_city
from citypv.core.light.change_light import trace_change
from citypv.core.light.errors_of_change import errors_of_difference
from citypv.core.run.study import (
    change_scene,
    compute_energy,
    make_located_scene,
    read_year,
    trace_base,
)
from citypv.core.run.variant import errors_of_change
from citypv.core.settings.progress import CancelledError


def add(*args):
    return CityChange(added=(make_city(box("new", *args)),))


def walls_below_a_canopy():
    """Those of a house whose roof it then is."""
    walls = [part for part in box("new", 6, 2, 10, 7, 0, 3.9) if part[1] == "WallSurface"]
    return CityChange(added=(make_city(walls),))


ALBEDOS = {
    "brighter": "surface,albedo\nfacade,0.6\nflat,0.1\n",
    "a mirror": "surface,albedo,material\nfacade,0.6,mirror\n",
}
EDITS = {
    "far beyond the border": ("row", add(400, 300, 12, 9, 0, 30), None),
    "the border house gone": ("houses", CityChange(removed=["b0"]), None),
    "across the border": ("houses", add(36, -6, 20, 20, 0, 9), None),
    "below the ground of before": ("houses", add(20, 50, 9, 9, -6, 5), None),
    "all but one gone": ("houses", CityChange(removed=[f"b{k}" for k in range(8)]), None),
    "a house into the hill": (
        "terrain",
        CityChange(raised={"b4": -4.0}, moved={"b1": (-9.0, 14.0)}),
        None,
    ),
    "brighter walls": ("row", CityChange(), "brighter"),
    "mirrors come": ("row", CityChange(raised={"b1": 2.0}), "a mirror"),
    "mirrors go": ("mirror", CityChange(), "brighter"),
    "a mirror goes": ("mirror", CityChange(removed=["b2"]), "a mirror"),
    "trees move and grow": (
        "trees",
        CityChange(moved={"t0": (-11.0, 3.0), "t1": (30.0, -20.0)}, removed=["b4"]),
        None,
    ),
    "trees go": ("trees", CityChange(removed=["t0", "t1"]), None),
    "a roof with racks rises": ("racks", CityChange(raised={"b4": 5.0}), None),
    "a tower beside racks": ("racks", add(13, 13, 2, 2, 0, 40), None),
    "the canopy gets walls": ("canopy", walls_below_a_canopy(), None),
    "the canopy goes": ("canopy", CityChange(removed=["b1"]), None),
    "the canopy's house goes": ("canopy", CityChange(removed=["b0"]), None),
    "a roof over the court": ("courtyard", add(7, 7, 16, 16, 12, 12.5), None),
    "the court opens": ("courtyard", CityChange(removed=["b1"]), None),
    "the court narrows": ("courtyard", CityChange(moved={"b4": (-4.99, 0.0)}), None),
    "a wall that touches": ("row", add(40, 0, 8, 10, 0, 20), None),
    "twice in one place": ("row", add(8, 0, 8, 10, 0, 9), None),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", mark_cases(EDITS, kept=8, law=(list(EDITS).index("mirrors come"),))
)
def test_a_hard_edit_is_the_edited_scene_traced_wholly(base_of, tmp_path, name):
    kind, edit, albedo = EDITS[name]
    city, base = base_of(kind)
    after = edit_city(city, edit, base.transfer.site.convergence)
    if albedo:
        (tmp_path / "albedo.csv").write_text(ALBEDOS[albedo])
    request = replace(base.request, albedo_file=albedo and str(tmp_path / "albedo.csv"))
    change = change_scene(base, city, after, request)
    edited = trace_change(base, change, request)
    assert edited.transfer.surfaces.surface_id[: len(after)] == after.surface_id
    check_law(edited, trace_wholly(base, change, request))


@pytest.mark.slow
def test_an_edit_can_be_interrupted_in_every_stage_and_tried_again(base_of):
    city, base = base_of("houses")
    after, stages = edit_city(city, CityChange(raised={"b4": 3.0})), []

    def trace(progress):
        change = change_scene(base, city, after, base.request, progress)
        return trace_change(base, change, progress=progress, preview=lambda *_: None)

    whole = trace(lambda stage, *_: stages.append(stage))
    told = list(dict.fromkeys(stages))
    assert len(told) > 4 and {"building the scene", "what the change reaches"} <= set(told)
    for stage in told:

        def stop(now, *_, stage=stage):
            if now == stage:
                raise CancelledError

        with pytest.raises(CancelledError):
            trace(stop)
    again = trace(lambda *_: None)
    assert np.array_equal(again.transfer.diffuse_relative, whole.transfer.diffuse_relative)
    assert np.array_equal(again.transfer.direct_reflected, whole.transfer.direct_reflected)


@pytest.mark.slow
def test_the_error_of_a_difference_is_its_scatter():
    """A tower beside nine houses, with 16 seeds: noise that both cities share does not count."""
    city, _ = make("houses")
    change = CityChange(added=(make_city(box("tower", 13, -8, 5, 5, 0, 30)),))
    request = replace(REQUEST, max_bounces=2, suns="days:4")
    after, scene = edit_city(city, change), make_located_scene(city, request)
    weather, differences, stated, apart = read_year(scene.site, request), [], [], []
    for seed in range(16):
        base = trace_base(scene, weather, replace(request, seed=seed))
        edited = trace_change(base, change_scene(base, city, after, base.request))
        found, (old, new) = errors_of_difference(base, edited)
        differences.append(
            annual_light(edited.city.transfer)[:, new] - annual_light(base.transfer)[:, old]
        )
        for errors, one in ((stated, found), (apart, base.transfer)):
            errors.append([one.diffuse_relative_standard_error, one.direct_annual_standard_error])
    counted = found.surfaces.eligible
    scatter = np.var(differences, axis=0, ddof=1)[:, counted].mean(axis=1)
    told, alone = (np.square(errors).mean(axis=0) for errors in (stated, apart))
    ratio = np.sqrt(told[:, counted].mean(axis=1) / scatter)
    assert (ratio > 0.8).all()
    assert (ratio < 1.25).all()
    assert (told[:, counted].mean(axis=1) < alone[:, old][:, counted].mean(axis=1)).all()


@pytest.mark.slow
def test_the_error_of_a_difference_is_the_same_both_ways():
    """Of an edit and of its undoing, whichever of the two cities knows what the choice of suns adds
    to its error.
    """
    city, request = make("row")
    scene = make_located_scene(city, request)
    base = trace_base(scene, read_year(scene.site, request), request)
    after = edit_city(city, CityChange(raised={"b3": 9.0}))
    edited = trace_change(base, change_scene(base, city, after, base.request))
    weather, errors = read_year(scene.site, request), []
    record = replace(base.transfer.record, sun_sampling={"bias": 1.0, "rms": 2.0})
    leaf = base.city.states[0]
    states = [replace(leaf, transfer=replace(leaf.transfer, record=record))]
    knows = replace(base, city=replace(base.city, states=states))
    for pair in ((knows, edited), (edited, knows)):
        found, _ = errors_of_difference(*pair)
        errors.append(compute_energy(found, weather, request).full_load_hours_standard_error)
    errors = np.nan_to_num(errors)
    assert errors[0].max() > 1
    assert errors[0] == pytest.approx(errors[1], rel=0.15, abs=0.05)
    # Hours that are known of the city after, and those of dimmed surfaces, give the same errors.
    told = errors_of_change(
        base, edited, weather, request, compute_energy(edited.transfer, weather, request)
    )
    assert told[0] == found.surfaces.surface_id
    found, _ = errors_of_difference(base, edited)
    whole = compute_energy(found, weather, request).full_load_hours_standard_error
    assert told[1] == pytest.approx(whole, rel=0.02, abs=1e-9, nan_ok=True)
