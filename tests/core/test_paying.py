"""Which faces pay: `--least-hours` and `--leave-out` act on modules and sums alone."""

import csv
import json

import numpy as np
import pytest
from small_city import FAST, house, write_gml
from transfers import make_surfaces, unshaded_transfer

from citypv.core.commands.command_line import main
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.left_out import describe_gone, read_left_out, words_of_surfaces
from citypv.core.energy.paying import choose_modules
from citypv.core.energy.pv_system import build_system
from citypv.core.results.read_results import read_results
from citypv.core.results.supply_curve import sum_by_hours, supply_curve
from citypv.core.results.write_summary import sum_totals
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.read_weather import read_weather

LEAST = 500.0  # [h] between north and south of the small city


def read_rows(folder, name="faces.csv"):
    """Rows of a table as the csv module reads them: list of dict of str."""
    with (folder / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def numbers(rows, name):
    return np.array([float(row[name] or "nan") for row in rows])


def weigh(source, out, *options):
    """The same light with another choice of modules: rows of faces.csv, and the summary."""
    assert main(["yield", str(source), "--out", str(out), *options, "--quiet"]) == 0
    return read_rows(out), json.loads((out / "summary.json").read_text("utf-8"))


def write_list(path, text):
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.slow
def test_few_hours_take_modules_and_sums_alone(small_results, tmp_path):
    """All that a planner adds up is a sum over the rows of faces.csv with enough hours."""
    before, whole = weigh(small_results, tmp_path / "whole")
    after, found = weigh(small_results, tmp_path / "some", "--least-hours", str(LEAST))
    # Hours of the open area, from the table without a choice.
    area, opened, kwp = (numbers(before, name) for name in ("area", "open_area", "kwp"))
    hours = numbers(before, "full_load_hours") * area / np.where(opened > 0, opened, np.nan)
    pays, carried = (kwp > 0) & (hours >= LEAST), kwp > 0
    assert 3 < pays.sum() < carried.sum()
    np.testing.assert_array_equal(numbers(after, "kwp"), np.where(pays, kwp, 0))
    np.testing.assert_array_equal(numbers(after, "module_area") > 0, pays)
    low = carried & ~pays
    assert [row["reason"] for row in after] == [
        "low-hours" if few else row["reason"] for few, row in zip(low, before, strict=True)
    ]
    totals, every = found["totals"], whole["totals"]
    assert totals["kwp"] == pytest.approx(kwp[pays].sum(), rel=1e-5)
    assert totals["mwh_per_year"] == pytest.approx((kwp * hours)[pays].sum() / 1000, rel=1e-5)
    assert totals["count"] == pays.sum() and every["count"] == carried.sum()
    assert totals["without_modules"]["low-hours"]["count"] == low.sum()
    for one in (totals, every):
        left = sum(part["area"] for part in one["without_modules"].values())
        assert one["eligible_area"] + left == pytest.approx(area.sum(), rel=1e-5)
    # Buildings sum up to the same; light, groups and errors are those of all faces.
    buildings = read_rows(tmp_path / "some", "buildings.csv")
    assert numbers(buildings, "kwp").sum() == pytest.approx(totals["kwp"], rel=1e-5)
    of_modules = ("kwp", "module_count", "module_area", "reason")
    same = [name for name in before[0] if name not in of_modules]
    assert [[row[name] for name in same] for row in after] == [
        [row[name] for name in same] for row in before
    ]
    groups = [(tmp_path / name / "groups.csv").read_bytes() for name in ("whole", "some")]
    of_modules = {"windows": None, "string_shade": None}
    budgets = [one["error_budget"] | of_modules for one in (found, whole)]
    assert groups[0] == groups[1] and budgets[0] == budgets[1]
    # What read them back has the same modules.
    results = read_results(tmp_path / "some")
    assert (results.faces["counted_area"] > 0).sum() == carried.sum()


@pytest.mark.slow
def test_what_is_left_out_by_building_and_by_face(small_results, tmp_path):
    path = write_list(tmp_path / "list.csv", "id,words\nb,protected\na_roof_south,has one\n")
    before, _ = weigh(small_results, tmp_path / "whole")
    after, found = weigh(small_results, tmp_path / "some", "--leave-out", path)
    left = 0
    for old, new in zip(before, after, strict=True):
        words = {"b": "protected"}.get(
            old["building_id"], "has one" if old["surface_id"] == "a_roof_south" else None
        )
        if words is None or old["reason"]:
            assert new == old
        else:
            left += 1
            assert [new[name] for name in ("reason", "reason_note", "eligible")] == [
                "left-out",
                words,
                "true",
            ]
            assert float(new["kwp"]) == 0 and new["full_load_hours"] == old["full_load_hours"]
    assert left == 7 == found["totals"]["without_modules"]["left-out"]["count"]


def test_hours_are_of_the_open_part_and_what_is_left_out_goes_first():
    """A wall of which a half is covered pays like an open one: its mean is half of the hours."""
    weather = read_weather("clear-sky", 52.5, 13.4)
    transfer = unshaded_transfer(choose_suns("days:2", *weather.axis), [90, 90, 90], [180, 180, 0])
    transfer.surfaces.area[:], transfer.surfaces.eligible[:] = 20.0, True
    transfer.covered_share[1] = 0.5
    for part in (
        transfer.visible_share,
        transfer.diffuse_relative,
        transfer.far_ground_view_factor,
    ):
        part[1] *= 0.5
    hours = compute_energy(transfer, weather, build_system(Request())).full_load_hours
    assert hours[1] == pytest.approx(hours[0] / 2, rel=1e-3) and hours[2] < 0.7 * hours[0]
    system = build_system(Request(least_hours=0.9 * hours[0]))
    energy = compute_energy(transfer, weather, system)
    assert energy.reason.tolist() == ["", "", "low-hours"] and energy.eligible.all()
    assert energy.summed.tolist() == [True, True, False] and (energy.counted_area > 0).all()
    assert sum_totals(transfer, energy, system)["dark"]["count"] == 0
    # Another choice from the same hours, back to none.
    system.leave_out.update({"s2": "a gable", "b0": ""})
    chosen = choose_modules(energy, transfer.surfaces, system)
    assert chosen.reason.tolist() == ["left-out"] * 3 and not chosen.kwp.any()
    assert chosen.reason_note.tolist() == ["", "", "a gable"]
    every = choose_modules(chosen, transfer.surfaces, build_system(Request()))
    assert (every.reason == "").all() and every.kwp[0] == pytest.approx(2 * every.kwp[1])
    # Exactly as many hours as are asked for are enough.
    at = choose_modules(
        every, transfer.surfaces, build_system(Request(least_hours=float(hours[2])))
    )
    assert at.kwp[2] > 0


def test_the_supply_curve_is_a_sum_from_above():
    rng = np.random.default_rng(1)
    kind = rng.choice(["facade", "roof", "flat", "steep", "rack"], 500)
    hours, kwp = rng.gamma(6, 120, 500), rng.uniform(0, 20, 500)
    hours[0], hours[1] = 0.0, 10 * (hours.max() // 10 + 1)
    curve = supply_curve(sum_by_hours(kind, hours, kwp))
    last = int(hours.max() // 10)
    for side, chosen in (("facades", kind == "facade"), ("roofs", kind != "facade")):
        for name, values in (("kwp", kwp), ("mwh", kwp * hours / 1000)):
            expected = [values[chosen & (hours >= 10 * k)].sum() for k in range(last + 2)]
            np.testing.assert_allclose(curve[side][name], expected, rtol=1e-5, atol=1e-9)
    assert curve["facades"]["kwp"][-1] == curve["roofs"]["kwp"][-1] == 0 < hours.max()


def test_a_list_of_ids_is_read_or_refused_by_its_line(tmp_path):
    good = '\ufeffid,words\nx,"old, protected"\n\'=y,\nz\n'
    assert read_left_out(write_list(tmp_path / "good.csv", good)) == {
        "x": "old, protected",
        "=y": "",
        "z": "",
    }
    assert read_left_out(write_list(tmp_path / "ids.csv", "id\nx\n")) == {"x": ""}
    for text, words in (
        ("surface,words\nx,y\n", "line 1 is not the header id,words; add it"),
        ("id,words\nx,y,z\n", "line 2 is not an id and words"),
        ("id,words\nx,y\n\n", "line 3 is not an id and words"),
        ("id,words\nx,y\nx,z\n", "line 3 has 'x' again; name each id once"),
    ):
        with pytest.raises(InputError, match=words):
            read_left_out(write_list(tmp_path / "bad.csv", text))
    with pytest.raises(InputError, match=r"none\.csv"):
        build_system(Request(leave_out=str(tmp_path / "none.csv")))


def test_a_face_has_its_own_words_before_those_of_its_polygon_and_its_building():
    surfaces = make_surfaces([90] * 9, [180] * 9)  # seven on the first building
    surfaces.surface_id[:4] = ["wall#0", "wall#1", "roof", "wall#x"]
    found = words_of_surfaces(
        surfaces, {"wall": "cells", "wall#1": "own", "b0": "house", "b": "no"}
    )
    assert found == ["cells", "own", *["house"] * 5, None, None]


@pytest.mark.slow
def test_refused_before_anything_is_traced(city, small_results, tmp_path, refused):
    path = write_list(tmp_path / "list.csv", "id,words\nnobody,\n")
    words = "list.csv: 'nobody' is neither a surface nor a building of this city; take surface_id"
    for command in (["simulate", city], ["yield", small_results]):
        out = "--out", tmp_path / "out", "--quiet"
        assert words in refused(*command, *out, "--leave-out", path)
        assert "--least-hours: -1.0 is out of range" in refused(*command, *out, "--least-hours=-1")
        assert not (tmp_path / "out").exists()
    for option in (["--least-hours", "400"], ["--leave-out", path]):
        said = refused("accuracy", city, *option)
        assert f"{option[0]}: means nothing for errors, which are those of all faces" in said
        said = refused("world", "unshaded", "--out", tmp_path / "world", *option, "--quiet")
        assert f"{option[0]}: means nothing for this world" in said


@pytest.mark.slow
def test_an_edit_keeps_the_choice_and_names_what_it_removed(tmp_path, capfd):
    """The list is kept with the rays: its file may be gone."""
    houses = house("a", (0, 0), (12, 10, 8)) + house("b", (20, -3), (10, 14, 14))
    path = write_list(tmp_path / "list.csv", "id,words\na,protected\nb,ours\n")
    city, base = write_gml(tmp_path / "city.gml", houses), tmp_path / "base"
    asked = ["--leave-out", path, "--least-hours", "300", "--editable", *FAST]
    assert main(["simulate", str(city), "--out", str(base), *asked]) == 0
    (tmp_path / "list.csv").unlink()
    made = ["variant", str(base), "--remove", "b", "--out", str(tmp_path / "edited")]
    assert main(made) == 0
    assert "not in this city any more: b" in capfd.readouterr().err
    rows = read_rows(tmp_path / "edited")
    assert {row["reason_note"] for row in rows if row["reason"] == "left-out"} == {"protected"}
    summary = json.loads((tmp_path / "edited" / "summary.json").read_text("utf-8"))
    assert summary["variant"]["note"].endswith("not in this city any more: b")
    assert summary["settings"]["leave_out"] == path
    assert summary["settings"]["least_hours"] == 300 and summary["totals"]["kwp"] == 0
    write_list(tmp_path / "list.csv", "id,words\na,protected\nb,ours\n")
    capfd.readouterr()
    again = ["yield", str(tmp_path / "edited"), "--out", str(tmp_path / "again")]
    assert main([*again, "--leave-out", path]) == 0
    assert "not in this city any more: b" in capfd.readouterr().err
    assert describe_gone(read_transfer_surfaces(tmp_path / "base"), path) == ""


def read_transfer_surfaces(folder):
    from citypv.core.results.transfer_file import read_transfer

    return read_transfer(folder / "transfer.nc").surfaces


@pytest.mark.slow
def test_a_comparison_counts_on_the_modules_of_before(tmp_path, capfd):
    """A tower takes light from a roof that then has too few hours; taken away, it pays again."""
    low, tower = house("a", (0, 0), (12, 10, 8)), house("t", (0, -16), (12, 10, 30))
    cities = {"open": low, "shaded": low + tower}
    for name, houses in cities.items():
        path = write_gml(tmp_path / f"{name}.gml", houses)
        assert main(["simulate", str(path), "--out", str(tmp_path / name), *FAST]) == 0
    hours = {
        name: {
            row["surface_id"]: float(row["full_load_hours"])
            for row in read_rows(tmp_path / name)
            if row["kwp"] != "0"
        }
        for name in cities
    }
    # Between the hours of the southern roof in the sun and in the shade.
    least = (hours["open"]["a_roof_south"] + hours["shaded"]["a_roof_south"]) / 2
    for name in cities:
        weigh(tmp_path / name, tmp_path / f"{name}_chosen", "--least-hours", f"{least:.1f}")
    names = "open_chosen", "shaded_chosen"
    for before, after, key in ((*names, "no_longer"), (*reversed(names), "newly")):
        out = tmp_path / f"to_{after}"
        capfd.readouterr()
        compared = ["compare", str(tmp_path / before), str(tmp_path / after), "--out", str(out)]
        assert main(compared) == 0
        said = capfd.readouterr()
        words = ("Would no longer pay, below", "Would pay now, from")[key == "newly"]
        assert words in said.out + said.err
        assert words in (out / "report.html").read_text("utf-8")
        paying = json.loads((out / "summary.json").read_text("utf-8"))["paying"]
        assert "a_roof_south" in paying[key]["surfaces"]
        # Energy after is that of the modules of before at the hours of after, by hand.
        modules = {row["surface_id"]: float(row["kwp"]) for row in read_rows(tmp_path / before)}
        state = after.removesuffix("_chosen")
        for row in read_rows(out, "surfaces.csv"):
            if row["state"] == "existing":
                kwp = modules[row["surface_id"]]
                expected = kwp * hours[state].get(row["surface_id"], 0) / 1000
                assert float(row["mwh_after"] or 0) == pytest.approx(expected, rel=1e-4)
