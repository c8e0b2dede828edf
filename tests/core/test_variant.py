"""Variants of a city from its kept rays: the results of a run of the edited city."""

import runpy
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from cities import box, make_city
from small_city import UP, house, write_gml, write_small_city
from thorough import draw_count, mark_cases

import citypv
from citypv.__main__ import main
from citypv.core.city.city import Tree
from citypv.core.city.edit_city import CityChange, edit_city, place_local
from citypv.core.city.transform_crs import Grid
from citypv.core.commands.command_line import build_parser
from citypv.core.light.rays_file import encode, read_rays
from citypv.core.results.transfer_file import read_transfer

FEW = {"weather": "clear-sky", "samples": 64, "shadow_samples": 16, "suns": "days:2", "threads": 1}
OPTIONS = [
    part for name, value in FEW.items() for part in (f"--{name.replace('_', '-')}", str(value))
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A result folder of three houses that can be edited; its files are gone."""
    folder = tmp_path_factory.mktemp("variant")
    city, albedo = write_small_city(folder / "small.gml"), folder / "albedo.csv"
    albedo.write_text("surface,albedo\nroof,0.4\n", encoding="utf-8")
    made = ["simulate", str(city), "--out", str(folder / "base"), *OPTIONS, "--quiet", "--editable"]
    assert main([*made, "--albedo-file", str(albedo)]) == 0
    write_gml(folder / "tower.gml", house("tower", (0, -16), (12, 10, 40)))
    albedo.rename(folder / "kept.csv")
    return folder


def trace_anew(folder, name, houses, **more):
    """Results of a run of an edited city at the place of the base."""
    path = write_gml(folder / f"{name}.gml", houses)
    told = {"albedo_file": folder / "kept.csv", "site_of": folder / "base", **more}
    return citypv.simulate(path, **FEW | told)


def check_run(found, expected):
    """Hours are those of a run of the edited files, whose ground is laid anew, within the error
    that this states.
    """
    assert set(found.index) == set(expected.index)
    found = found.loc[expected.index]
    error = np.maximum(expected["full_load_hours_standard_error"], 1e-3)
    apart = (found["full_load_hours"] - expected["full_load_hours"]) / error
    assert np.sqrt((apart**2).mean()) <= 1.1
    area = expected["area"].where(expected["full_load_hours"].notna(), 0)
    totals = [(area * one["full_load_hours"].fillna(0)).sum() for one in (found, expected)]
    assert abs(totals[0] - totals[1]) <= np.sqrt(((area * error.fillna(0)) ** 2).sum())
    assert found["covered_share"].to_numpy() == pytest.approx(
        expected["covered_share"].to_numpy(), abs=0.02
    )


A, B, C = (
    house("a", (0, 0), (12, 10, 8)),
    house("b", (20, -3), (10, 14, 14)),
    house("c", (2, 24), (14, 9, 6)),
)
EDITS = {
    "a tower": (["--add", "tower.gml"], A + B + C + house("tower", (0, -16), (12, 10, 40))),
    "one less": (["--remove", "b"], A + C),
    "one raised": (["--raise", "c=5"], A + B + house("c", (2, 24), (14, 9, 11))),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "a tower",
        *(pytest.param(name, marks=pytest.mark.thorough) for name in ("one less", "one raised")),
    ],
)
def test_the_results_of_a_run_of_the_edited_city(name, folder, monkeypatch):
    monkeypatch.chdir(folder)
    options, houses = EDITS[name]
    assert main(["variant", "base", *options, "--out", "out", "--overwrite", "--quiet"]) == 0
    expected = trace_anew(folder, "edited", houses).faces.set_index("surface_id")
    found = citypv.read_results("out").faces.set_index("surface_id")
    check_run(found, expected)
    assert list(found.index) == list(pd.read_csv("out/faces.csv")["surface_id"])
    change = (
        citypv.compare("base", "out")
        .surfaces.query("state == 'existing'")
        .dropna(subset="full_load_hours_after")
    )
    error, difference = (
        change["full_load_hours_change_standard_error"],
        change["full_load_hours_change"],
    )
    own = pd.read_csv("out/faces.csv").set_index("surface_id")["full_load_hours_standard_error"]
    assert (error[difference == 0] == 0).all()
    assert error.sum() < own[change["surface_id"]].sum()  # the noise that both share cancels


@pytest.mark.slow
def test_a_building_that_does_not_stand_on_the_ground_is_told(folder, tmp_path):
    """A run of the edited files would lay its ground through the new feet, 0.4 m higher; of 0.05 m
    nothing is said.
    """
    base = citypv.read_results(folder / "base")
    for high in (0.4, 0.05):
        raised = house("up", (40, -30), (8, 8, 9)).replace(f"{UP:.3f}", f"{UP + high:.3f}")
        path = write_gml(tmp_path / f"up{high}.gml", raised)
        notes = base.variant(add=[path]).summary["input"]["report"]["notes"]
        told = [note for note in notes if note.startswith("Ground: an edit leaves it as it lies")]
        assert ["0.4 m above" in note for note in told] == ([True] if high > 0.1 else [])


@pytest.mark.thorough
def test_a_hundred_variants_in_a_row_do_not_grow(folder, tmp_path):
    """Neither memory nor what each keeps: measured, 356 MB and 380 kB after the tenth and after the
    sixtieth.
    """
    program = f"""
import os, citypv
from pathlib import Path
base = citypv.read_results({str(folder / "base")!r})
def sizes():
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    files = len(os.listdir("/proc/self/fd"))
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6, (base.folder / "rays.nc").stat().st_size / 1e6, files
for k in range(100):
    base = base.variant(raised={{"b": 1 if k % 2 == 0 else -1}}, exports=("editable",))
    if k in (9, 99):
        print(*sizes())
print(base.faces["full_load_hours"].mean())
"""
    if not Path("/proc/self/statm").exists():
        pytest.skip("needs /proc")
    told = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    early, late, (hours,) = (
        [float(one) for one in line.split()] for line in told.stdout.splitlines()
    )
    assert late[0] - early[0] < 10  # [MB]
    assert late[1] < 1.2 * early[1]
    assert late[2] == early[2]
    # It stands as high as at first, and yields as much.
    assert hours == pytest.approx(
        citypv.read_results(folder / "base").faces["full_load_hours"].mean(), rel=0.005
    )


@pytest.mark.slow
def test_in_python(folder):
    base = citypv.read_results(folder / "base")
    less = base.variant(remove=["b"])
    assert set(less.faces["building_id"]) == {"a", "c"}
    with pytest.raises(
        citypv.InputError, match="delete: is no change of a city; give some of add, remove"
    ):
        base.variant(delete=["b"])
    with pytest.raises(citypv.InputError, match="so this run cannot be edited"):
        less.variant(remove=["a"])


@pytest.mark.slow
@pytest.mark.thorough
def test_a_building_at_several_heights(folder, tmp_path):
    """What the example's building gains and the others lose are differences of full runs, to a
    hundredth.
    """
    example = runpy.run_path(str(Path(citypv.__file__).parent / "examples/tower_heights.py"))
    base = citypv.read_results(folder / "base")
    table = example["raise_in_steps"](base, "a", [0, 20])
    assert not table.loc[0].any()
    full = trace_anew(folder, "higher", house("a", (0, 0), (12, 10, 28)) + B + C)
    after, before = (one.buildings.set_index("building_id")["mwh_per_year"] for one in (full, base))
    change = after - before
    others = change.drop("a").sum()
    np.testing.assert_allclose(
        table.loc[20, ["gain", "loss"]], [change["a"], -others], rtol=0.01, atol=0.01
    )
    assert others < -table.loc[20, "loss_error"] < 0
    example["draw_heights"](table, tmp_path / "heights.png")
    assert plt.imread(tmp_path / "heights.png").std() > 0


@pytest.mark.slow
def test_variants_of_variants_and_albedos_of_buildings(folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert (
        main(["variant", "base", "--move", "a=1.5,-2", "--out", "moved", "--quiet", "--editable"])
        == 0
    )
    back = [
        "variant",
        "moved",
        "--move",
        "a=-1.5,2",
        "--albedo-of",
        "b=0.7",
        "--out",
        "back",
        "--quiet",
    ]
    assert main(back) == 0
    (folder / "kept.csv").rename(folder / "before.csv")
    ids = [
        name for name in citypv.read_results("base").faces["surface_id"] if name.startswith("b_")
    ]
    lines = "".join(f"{name},0.7\n" for name in ids)
    (folder / "kept.csv").write_text(f"surface,albedo\nroof,0.4\n{lines}", encoding="utf-8")
    expected = trace_anew(folder, "white", A + B + C).faces.set_index("surface_id")
    (folder / "before.csv").replace(folder / "kept.csv")
    found = citypv.read_results("back")
    check_run(found.faces.set_index("surface_id"), expected)
    assert found.summary["settings"]["albedo_file"].endswith("albedo.csv")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["base", "--remove", "z"],
            "z: no building of the city has this id; take ids from the column building_id",
        ),
        (["base", "--raise", "c"], "'c' is not ID=NUMBER"),
        (["base", "--move", "c=1"], "'c=1' is not ID=NUMBER,NUMBER"),
        (["base", "--albedo-of", "z=0.2"], "z: no building of the city has this id"),
        (["base", "--add", "local.obj"], "names no coordinate reference system; add --local"),
        (
            ["plain", "--remove", "a"],
            "rays.nc: there is no such file, so this run cannot be edited",
        ),
    ],
)
def test_refused_with_one_line(arguments, words, folder, monkeypatch, refused):
    monkeypatch.chdir(folder)
    (folder / "plain").mkdir(exist_ok=True)
    (folder / "local.obj").write_text("v 0 0 0\nv 9 0 0\nv 0 9 5\nf 1 2 3\n")
    assert words in refused("variant", *arguments, "--out", "refused", "--quiet")
    assert not (folder / "refused").exists()


@pytest.mark.slow
def test_rays_of_an_earlier_version_are_refused_with_the_command_that_traces_again(
    folder, tmp_path
):
    """The whole command, with the files and settings of its summary."""
    shutil.copytree(folder / "base", tmp_path / "old")
    with h5py.File(tmp_path / "old" / "rays.nc", "a") as file:
        file.attrs["title"] = "CityPV rays 5"
    with pytest.raises(citypv.InputError) as refusal:
        read_rays(tmp_path / "old")
    words = shlex.split(str(refusal.value).partition("trace the city again: ")[2])
    assert words[:2] == ["citypv", "simulate"] and words[2].endswith("small.gml")
    parsed = vars(build_parser().parse_args(words[1:]))
    assert parsed["samples"] == 64 and parsed["suns"] == "days:2" and "--editable" in words
    assert parsed["albedo_file"].endswith("albedo.csv")


@pytest.mark.slow
@pytest.mark.parametrize("rise", mark_cases([-6, -6.5, -50], kept=1))
def test_no_building_is_turned_inside_out(rise, folder, monkeypatch, refused):
    """c is 6 m high up to its eaves."""
    monkeypatch.chdir(folder)
    said = refused("variant", "base", "--raise", f"c={rise}", "--out", "refused", "--quiet")
    assert (
        f"--raise: c has corners 6 m above its foot: {rise:g} m would turn it inside out; give "
        "more than -6" in said
    )
    kept = read_rays(folder / "base")
    low = edit_city(kept.city, CityChange(raised={"c": -5.5}), 0.0)
    assert low.points[:, 2].min() == kept.city.points[:, 2].min()


def described(folder):
    """What is kept of a run, but for the request, whose files lie in a temporary folder of each
    reading.
    """
    told = encode(read_rays(folder), [])
    told["fields"].pop("request")
    return told


@pytest.mark.thorough
def test_a_flipped_bit_is_refused_or_changes_nothing(folder, tmp_path):
    data, generator, refused = (
        (folder / "base" / "rays.nc").read_bytes(),
        np.random.default_rng(1),
        0,
    )
    whole, count = described(folder / "base"), draw_count(60, 24)
    for place in generator.integers(0, len(data), count):
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(generator.integers(8))
        (tmp_path / "rays.nc").write_bytes(bytes(damaged))
        try:
            told = described(tmp_path)
        except citypv.InputError as error:
            assert "rays.nc: " in str(error)
            refused += 1
        else:
            assert told == whole
    assert refused > 0  # a third of all bits: much of so small a file is empty


@pytest.mark.slow
def test_local_trees_and_buildings_stand_by_the_origin(folder):
    """A box and a tree of a city in metres from the origin of the base, whose grid is turned by its
    convergence.
    """
    site = read_rays(folder / "base").scene.site
    tree = Tree("t", "made", 1, place=np.array([30.0, 40.0, 0.0]), height=9.0)
    city = make_city(box("new", 30, 40, 5, 5, 0, 9))
    city.trees = [tree]
    placed = place_local(city, site, Grid("EPSG:25833"))
    turn = np.radians(site.convergence)
    east = 30 * np.cos(turn) - 40 * np.sin(turn), 30 * np.sin(turn) + 40 * np.cos(turn)
    expected = np.array(site.origin) + np.array([*east, 0.0])
    assert placed.trees[0].place == pytest.approx(expected, abs=1e-6)
    assert np.linalg.norm(placed.points - expected, axis=1).min() < 1e-6


def check_before(base, variant, expected):
    """`compare` takes as before the hours of a run of the base with the variant's light, which the
    variant keeps.
    """
    compared = citypv.compare(base, variant)
    kept, hours = pd.read_csv(f"{variant}/before.csv"), expected.faces["full_load_hours"].to_numpy()
    assert np.isfinite(hours).any()
    np.testing.assert_allclose(kept["full_load_hours"], hours, rtol=1e-5)
    before, after = (
        one.summary["totals"]["mwh_per_year"] for one in (expected, citypv.read_results(variant))
    )
    sums = compared.summary["sums"]["all"]
    assert sums["mwh_before"] == pytest.approx(before, rel=1e-4)
    assert sums["mwh_change"] == pytest.approx(after - before, abs=1e-3 * before)
    light = read_transfer(Path(variant) / "transfer.nc").base
    assert light.surfaces.surface_id == kept["surface_id"].tolist()
    np.testing.assert_allclose(
        light.diffuse_relative, expected.faces["diffuse_relative"], rtol=1e-5
    )
    return compared


@pytest.mark.thorough
def test_a_city_that_reflects_more_often_is_told_against_its_base_with_as_many_reflections(
    tmp_path, monkeypatch, capfd
):
    """Two blocks beside a street get white: the variant equals a run, and so does what `compare`
    takes as before.
    """
    monkeypatch.chdir(tmp_path)
    write_gml(
        tmp_path / "street.gml",
        house("a", (0, 0), (30, 10, 15)) + house("b", (0, 16), (30, 10, 15)),
    )
    Path("white.csv").write_text(
        "surface,albedo\nfacade,0.9\nroof,0.9\ndownward,0.9\n", encoding="utf-8"
    )
    assert main(["simulate", "street.gml", "--out", "base", *OPTIONS, "--quiet", "--editable"]) == 0
    edit = ["variant", "base", "--albedo-of", "a=0.9", "b=0.9", "--out", "white", "--editable"]
    assert main(edit) == 0
    assert "the light of the base is solved" in capfd.readouterr().err.lower()
    few = citypv.read_results("base").summary["traced"]["max_bounces"]
    many = citypv.read_results("white").summary["traced"]["max_bounces"]
    full = citypv.simulate("street.gml", **FEW, site_of="base", albedo_file="white.csv")
    assert full.summary["traced"]["max_bounces"] == many > 2 * few
    found, expected = (
        one.summary["totals"]["mwh_per_year"] for one in (citypv.read_results("white"), full)
    )
    assert found == pytest.approx(expected, rel=1e-5)
    check_before("base", "white", citypv.simulate("street.gml", **FEW, max_bounces=many))
    assert main(["compare", "base", "white", "--out", "compared"]) == 0
    told = capfd.readouterr().err
    assert f"Before is base with the light that white asks for: {many} reflections" in told
    assert "traced with other settings" not in told  # albedos are the edit
    assert f"{many} reflections" in Path("compared/report.html").read_text("utf-8")
    # A variant of it has that many already, and one that takes nothing back is the same city.
    assert main(["variant", "white", "--raise", "a=0", "--out", "again", "--quiet"]) == 0
    again = citypv.compare("white", "again")
    assert not Path("again/before.csv").exists() and "base_light" not in again.summary
    assert again.summary["sums"]["all"]["mwh_change"] == 0
    # Other weather takes the light of before along.
    assert main(["yield", "white", "--out", "cloudy", "--weather", "climate", "--quiet"]) == 0
    expected = citypv.read_results("base").with_weather("climate")
    cloudy = pd.read_csv("cloudy/before.csv")["full_load_hours"] / expected.faces["full_load_hours"]
    assert cloudy.dropna().between(0.97, 1.03).all()


@pytest.mark.slow
def test_a_white_canyon(tmp_path, monkeypatch):
    """Full runs before and after, of 15 reflections, say +55.4 ± 0.5 MWh; with the base's three it
    would be +41.5, of modules on every square metre.
    """
    monkeypatch.chdir(tmp_path)
    blocks = [
        write_box(tmp_path / f"{name}.obj", 0, 40, 15, depth=10, north=north)
        for name, north in (("a", 0), ("b", 16))
    ]
    place = {"latitude": 50, "longitude": 10, "layout": "area"}
    base = citypv.simulate(blocks, **place, out="base", exports=("editable",))
    base.variant(albedo_of={"a": 0.9, "b": 0.9}, out="white")
    change = citypv.compare("base", "white").summary["sums"]["all"]
    assert change["mwh_change"] == pytest.approx(55.4, abs=0.5)
    assert change["mwh_change_standard_error"] < 0.5


def write_box(path, east, width, height, *, depth=None, north=0):
    """An OBJ of a box with a level roof, square if it has no depth: its path."""
    plan = [
        (east + x, north + y)
        for x, y in ((0, 0), (width, 0), (width, depth or width), (0, depth or width))
    ]
    corners = [(x, y, z) for z in (0, height) for x, y in plan]
    faces = ("4 3 2 1", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8")
    lines = [
        "o " + path.stem,
        *(f"v {x} {y} {z}" for x, y, z in corners),
        *(f"f {face}" for face in faces),
    ]
    path.write_text("\n".join(lines), encoding="utf-8")
    return str(path)


@pytest.mark.thorough
def test_a_base_under_another_sky_is_solved_under_the_one_that_its_variant_asks_for(
    tmp_path, monkeypatch
):
    """Where only level roofs count the sky is even; a house whose walls count calls for that of
    Perez, and back.
    """
    monkeypatch.chdir(tmp_path)
    low, high = (
        write_box(tmp_path / "low.obj", 0, 20, 0.3),
        write_box(tmp_path / "high.obj", 30, 10, 12),
    )
    place = {"latitude": 50, "longitude": 10}
    citypv.simulate(low, **FEW, **place, out="base", exports=("editable",))
    assert citypv.read_results("base").summary["sky"] == "isotropic"
    assert main(["variant", "base", "--add", high, "--out", "out", "--quiet", "--editable"]) == 0
    compared = check_before("base", "out", citypv.simulate(low, **FEW, **place, sky="perez"))
    assert (
        compared.summary["base_light"]["sky"]
        == citypv.read_results("out").summary["sky"]
        == "perez"
    )
    full = citypv.simulate([low, high], **FEW, site_of="base", sky="perez").faces.set_index(
        "surface_id"
    )
    check_run(citypv.read_results("out").faces.set_index("surface_id"), full)
    assert main(["variant", "out", "--remove", "high", "--out", "less", "--quiet"]) == 0
    light = read_transfer(Path("less") / "transfer.nc").base
    full = citypv.simulate([low, high], **FEW, site_of="base", sky="isotropic").faces.set_index(
        "surface_id"
    )
    check_run(
        pd.read_csv("less/before.csv")
        .set_index("surface_id")
        .join(full[["area", "covered_share"]]),
        full,
    )
    assert not light.sources and len(light.surfaces) == len(full)
    check_run(
        *(citypv.read_results(name).faces.set_index("surface_id") for name in ("less", "base"))
    )
