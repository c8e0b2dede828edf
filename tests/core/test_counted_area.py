"""Which area counts: hidden walls, overhangs, usable shares, flat roofs; and the tables
made of it.
"""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from small_city import EAST, NORTH
from test_energy import KWP
from transfers import Horizons, unshaded_transfer
from weathers import ERA5, HOUR

from citypv.core.commands.command_line import main
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.counted_area import CHOSEN, OF_ROWS, REASONS, find_counted_area
from citypv.core.energy.energy import split_years
from citypv.core.energy.pv_system import build_system, dc_system
from citypv.core.results.write_buildings import sum_buildings
from citypv.core.results.write_summary import describe_years, sum_totals
from citypv.core.results.write_tables import write_groups
from citypv.core.settings.errors import InputError
from citypv.core.settings.presets import METHODS
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.read_weather import read_weather


@pytest.fixture(scope="module")
def transfer(berlin):
    """South walls alone, covered by 0 to 100 %, an overhang, a ceiling and three level roofs."""
    suns = choose_suns("typical-days:2", *berlin.axis)
    covered = np.array([0.0, 0.2, 0.5, 0.51, 1.0, 0.0, 0.0, 0.0, 0.3, 0.8, 0.0])
    result = unshaded_transfer(suns, [90] * 5 + [100, 180, 0, 5, 10, 3], [180] * 6 + [0] * 5)
    result.surfaces.area[:] = [100, 50, 40, 300, 200, 30, 90, 60, 80, 70, 5]
    result.covered_share[:] = covered
    result.visible_share *= (1 - covered)[:, None].astype(np.float32)
    result.diffuse_relative *= 1 - covered
    result.far_ground_view_factor *= 1 - covered
    result.surfaces.eligible[:] = [True] * 5 + [False] * 2 + [True] * 3 + [False]
    return result


@pytest.mark.slow
def test_hidden_walls_are_left_out(transfer, berlin):
    """A group's hours are Σ FLH·A / Σ A·(1 − covered_share): here those of an open wall."""
    energy = compute_energy(transfer, berlin)
    assert energy.eligible.tolist() == [True] * 3 + [False] * 4 + [True] * 2 + [False] * 2
    walls, level = ["", "", "", "covered", "covered"], ["", "", "covered", "small"]
    assert energy.reason.tolist() == [*walls, "overhang", "underside", *level]
    assert energy.groups == [
        ("facade", "south"),
        ("flat", "none"),
    ] and energy.group_count.tolist() == [3, 2]
    assert energy.group_area[0] == pytest.approx(100 + 40 + 20)
    np.testing.assert_allclose(energy.open_area[:5], [100, 40, 20, 147, 0])
    area, hours = transfer.surfaces.area[:3], energy.full_load_hours[:3]
    expected = (hours * area).sum() / 160
    assert energy.capacity_factor[:, 0].sum() == pytest.approx(expected, rel=1e-9)
    # The module is not linear, but nearly: half the light on half a wall gives what the open half
    # does, to 5 %.
    assert expected == pytest.approx(hours[0], rel=0.05)
    total = sum_totals(transfer, energy, build_system(Request()))
    facade = total["kinds"]["facade"]
    assert facade["eligible_area"] == pytest.approx(160) and facade["kwp"] == pytest.approx(
        160 / KWP
    )
    assert facade["full_load_hours"] == pytest.approx(expected)
    assert facade["mwh_per_year"] == pytest.approx(facade["kwp"] * expected / 1000)
    assert total["kwp"] == pytest.approx(sum(one["kwp"] for one in total["kinds"].values()))
    # Walls of 300 and 200 m² are hidden, and a roof of 70 m²; of those that count 10, 20 and 24 m².
    assert total["without_modules"] == {
        "covered": {"count": 3, "area": pytest.approx(300 + 200 + 70)},
        "parts": {"count": 3, "area": pytest.approx(10 + 20 + 24)},
        "overhang": {"count": 1, "area": 30.0},
        "underside": {"count": 1, "area": 90.0},
        "small": {"count": 1, "area": 5.0},
    }
    left_out = sum(one["area"] for one in total["without_modules"].values())
    assert total["eligible_area"] + left_out == pytest.approx(transfer.surfaces.area.sum())
    assert total["dark"] == {"count": 0, "area": 0}
    dim = replace(
        energy, full_load_hours=energy.full_load_hours * np.where(np.arange(11) == 2, 0.009, 1)
    )
    assert sum_totals(transfer, dim, build_system(Request()))["dark"] == {
        "count": 1,
        "area": pytest.approx(20),
    }


def test_what_has_no_room_carries_no_modules(transfer, berlin):
    """0.3 of the first wall, 0.4 of the second and 0.3 of the third, of which half is covered; all
    of a roof.
    """
    cramped = np.zeros((11, 2))
    cramped[[0, 1, 2, 7], 1] = 0.3, 0.4, 0.3, 1
    known = replace(transfer, no_room=cramped, clearances=(0.01, 0.3))
    energy, system = compute_energy(known, berlin), build_system(Request())
    assert energy.eligible.tolist() == [True, False, False] + [False] * 5 + [True] + [False] * 2
    # The second has 0.2 covered and 0.4 cramped, together more than half.
    np.testing.assert_allclose(energy.open_area[[0, 1, 2, 7, 8]], [70, 20, 8, 0, 56])
    left_out = sum_totals(known, energy, system)["without_modules"]
    assert left_out["no-room"] == {
        "count": 3,
        "area": pytest.approx(50 + 40 + 60),
    }
    assert left_out["parts"]["area"] == pytest.approx(30 + 24)
    whole = sum_totals(known, energy, system)["eligible_area"] + sum(
        one["area"] for one in left_out.values()
    )
    assert whole == pytest.approx(transfer.surfaces.area.sum())
    paper = compute_energy(known, berlin, build_system(Request(clearance=0.01)))
    assert (paper.eligible == compute_energy(transfer, berlin).eligible).all()
    with pytest.raises(InputError, match=r"--clearance: 0\.1 m was not traced; give 0\.01 or 0\.3"):
        compute_energy(known, berlin, build_system(Request(clearance=0.1)))


def test_hidden_walls_counted_as_in_the_paper(transfer, berlin):
    system = build_system(Request(hidden_walls="count"))
    energy = compute_energy(transfer, berlin, system)
    assert energy.eligible.tolist() == [True] * 5 + [False] * 2 + [True] * 3 + [False]
    area = transfer.surfaces.area[:5]
    expected = np.average(energy.full_load_hours[:5], weights=area)
    assert energy.group_area[0] == area.sum()
    assert energy.capacity_factor[:, 0].sum() == pytest.approx(expected, rel=1e-9)
    total = sum_totals(transfer, energy, system)["kinds"]["facade"]
    assert total["kwp"] == pytest.approx(690 / KWP) and total["full_load_hours"] == pytest.approx(
        expected
    )
    # The columns stay means over the whole polygon, whatever counts.
    other = compute_energy(transfer, berlin, build_system(Request()))
    np.testing.assert_array_equal(energy.full_load_hours, other.full_load_hours)
    np.testing.assert_array_equal(energy.open_area, other.open_area)


def test_overhangs_are_facades_where_asked(transfer, berlin):
    energy = compute_energy(transfer, berlin, build_system(Request(overhangs="count")))
    assert energy.eligible.tolist() == [True] * 3 + [False] * 2 + [
        True,
        False,
        True,
        True,
        False,
        False,
    ]
    assert energy.group_area[0] == pytest.approx(190) and energy.full_load_hours[5] > 0
    assert np.isnan(energy.full_load_hours[6])  # a ceiling looks to no side
    assert np.isnan(compute_energy(transfer, berlin).full_load_hours[5])
    assert transfer.surfaces.kind[5] == "downward"  # the Transfer is not touched


def test_usable_shares_and_flat_roofs(transfer, berlin):
    system = build_system(Request(usable={"facade": 0.6, "flat": 0.5}))
    energy = compute_energy(transfer, berlin, system)
    whole = compute_energy(transfer, berlin, build_system(Request()))
    np.testing.assert_array_equal(energy.capacity_factor, whole.capacity_factor)
    total, all_of_it = (
        sum_totals(transfer, energy, system),
        sum_totals(transfer, whole, build_system(Request())),
    )
    for kind, share in (("facade", 0.6), ("flat", 0.5)):
        for name in ("module_area", "kwp", "mwh_per_year"):
            assert total["kinds"][kind][name] == pytest.approx(
                share * all_of_it["kinds"][kind][name]
            )
    assert total["eligible_area"] == all_of_it["eligible_area"]
    # A kWp on the walls and one on the roofs yield what they did before; of the whole they are
    # other shares now.
    for one in (total, *total["kinds"].values()):
        assert one["full_load_hours"] == pytest.approx(1000 * one["mwh_per_year"] / one["kwp"])
    facade, flat = (all_of_it["kinds"][kind] for kind in ("facade", "flat"))
    assert total["kinds"]["facade"]["full_load_hours"] == pytest.approx(facade["full_load_hours"])
    none = build_system(Request(usable={"facade": 0.0}))
    left = compute_energy(transfer, berlin, none)
    assert left.reason[:4].tolist() == ["usable", "usable", "usable", "covered"]
    bare = sum_totals(transfer, left, none)
    assert (
        bare["kinds"]["facade"]["full_load_hours"] is None
        and bare["kinds"]["facade"]["eligible_area"] > 0
    )
    assert bare["full_load_hours"] == pytest.approx(flat["full_load_hours"])
    # Level roofs of 60 and 80 m², the second covered by 30 %; the third is covered, the last too
    # small.
    assert flat["count"] == 2 and flat["eligible_area"] == pytest.approx(60 + 56)
    hours = (whole.full_load_hours[7] * 60 + whole.full_load_hours[8] * 80) / 116
    assert flat["full_load_hours"] == pytest.approx(hours) and flat["kwp"] == pytest.approx(
        116 / KWP
    )


def test_with_the_papers_sectors_flat_roofs_stand_beside_the_whole(transfer, berlin):
    paper = replace(
        transfer, surfaces=replace(transfer.surfaces, eligible=transfer.surfaces.kind == "facade")
    )
    some, every = build_system(Request(sectors="paper")), build_system(Request())
    energy = compute_energy(paper, berlin, some)
    total, whole = (
        sum_totals(paper, energy, some),
        sum_totals(transfer, compute_energy(transfer, berlin, every), every),
    )
    assert energy.groups == [("facade", "south")] and total["kinds"] == whole["kinds"]
    assert (
        total["kwp"] == total["kinds"]["facade"]["kwp"]
        and total["without_modules"] == whole["without_modules"]
    )


def test_each_reason_and_none_where_there_are_modules():
    """A surface for each reason, most of which have others too: the first of the table holds."""
    suns = choose_suns("days:1", *read_weather("clear-sky", 52.5, 13.4).axis)
    shapes = {  # -> tilt, azimuth, area [m²], covered, without room, class, kind
        "ground": (0, 0, 5, 0.9, 0, "GroundSurface", "ground"),
        "closure": (90, 180, 5, 0.9, 0, "ClosureSurface", "facade"),
        "underside": (180, 0, 5, 0.9, 0, "", "downward"),
        "overhang": (100, 180, 5, 0.9, 0, "", "downward"),
        "racks": (0, 0, 5, 0.9, 0, "", "flat"),
        "covered": (90, 180, 5, 0.6, 0.4, "", "facade"),
        "no-room": (90, 180, 5, 0.4, 0.2, "", "facade"),
        "small": (90, 140, 6.24, 0.5, 0, "", "facade"),
        "direction": (90, 140, 6.25, 0, 0.5, "", "facade"),
        "twin": (90, 180, 6.25, 0, 0, "", "facade"),
        "usable": (30, 180, 6.25, 0, 0, "", "roof"),
        "": (90, 180, 6.25, 0.5, 0, "", "facade"),
    }
    columns = map(list, zip(*shapes.values(), strict=True))
    tilt, azimuth, area, covered, cramped, thematic, kind = columns
    result = unshaded_transfer(suns, [*tilt, 10, 10], [*azimuth, 180, 0])
    result.surfaces.surface_id[:] = [*map(str, range(len(tilt))), "4/rack1", "level"]
    result.surfaces.kind[:] = np.array([*kind, "rack", "flat"])
    result.surfaces.thematic[:] = [*thematic, "", ""]
    result.surfaces.area[:] = [*area, 1, 7]
    result.surfaces.eligible[:] = [False] * 10 + [True] * 3 + [False]
    result.covered_share[:] = [*covered, 0, 0]
    result.no_room[:, 1] = [*cramped, 0, 0]
    system = build_system(Request(sectors="paper", usable={"roof": 0}))
    counted = find_counted_area(result, system)
    assert counted.reason.tolist() == [*shapes, "", ""]  # the paper's level roof carries modules
    assert ((counted.kwp > 0) == (counted.reason == "")).all()
    assert list(shapes) == [*(key for key in REASONS if key not in (*CHOSEN, *OF_ROWS)), ""]
    np.testing.assert_allclose(counted.kwp[-3:], np.array([6.25 / 2, 1, 7]) / KWP)


def three_years(berlin):
    """2015, 2017 and 2018, each brighter than the one before: years may lie apart."""
    parts = []
    for factor, year in ((0.8, 2015), (1.0, 2017), (1.3, 2018)):
        data = berlin.data.copy()
        data[["ghi", "dhi", "dni"]] *= factor
        parts.append(
            data.set_axis(data.index + (pd.Timestamp(f"{year}-01-01") - pd.Timestamp("2017-01-01")))
        )
    return [replace(berlin, data=data) for data in (*parts, pd.concat(parts))]


@pytest.mark.slow
def test_years_are_computed_each_and_averaged(berlin, tmp_path):
    *single, together = three_years(berlin)
    suns = choose_suns("typical-days:4", *berlin.axis)
    transfer = Horizons(40, 2).transfer(suns)
    hours = np.array([compute_energy(transfer, one).full_load_hours for one in single])
    energy = compute_energy(transfer, together)
    assert energy.years == 3
    np.testing.assert_allclose(energy.full_load_hours, hours.mean(axis=0), rtol=1e-6)
    write_groups(tmp_path / "groups.csv", energy)
    table = pd.read_csv(tmp_path / "groups.csv")
    years = describe_years(energy)
    assert years["years"] == [2015, 2017, 2018]
    for group, (kind, orientation) in enumerate(energy.groups):
        own = table[(table["kind"] == kind) & (table["orientation"] == orientation)]
        rows = own[own["period"] == "year"].set_index("index")["full_load_hours"]
        expected = [compute_energy(transfer, one).capacity_factor[:, group].sum() for one in single]
        assert rows.index.tolist() == [2015, 2017, 2018]
        np.testing.assert_allclose(rows, expected, rtol=1e-4)
        spread = years["groups"][f"{kind}_{orientation}"]
        assert spread["mean"] == pytest.approx(
            own[own["period"] == "annual"]["full_load_hours"].item(), rel=1e-5
        )
        assert spread["standard_deviation"] == pytest.approx(np.std(expected, ddof=1), rel=1e-6)
    alone = [compute_energy(transfer, one) for one in single]
    assert describe_years(alone[0]) == {}
    # Of three years the middle one is exceeded in half; a tenth is below all of them.
    system, dc = dc_system(), "mwh_per_year"
    table = sum_buildings(transfer, energy, together)
    each = [sum_buildings(transfer, one, own)[dc] for one, own in zip(alone, single, strict=True)]
    np.testing.assert_allclose(table[f"p50_{dc}"], np.median(each, axis=0), rtol=1e-6)
    np.testing.assert_allclose(table[f"p90_{dc}"], np.min(each, axis=0), rtol=1e-6)
    whole = sum_totals(transfer, energy, system)
    assert whole[f"p90_{dc}"] == pytest.approx(sum_totals(transfer, alone[0], system)[dc], rel=1e-6)


@pytest.mark.parametrize(
    ("start", "stop", "expected"),
    [
        ("2015-01-01", "2018-01-01", [2015, 2016, 2017]),  # with a leap year
        ("2014-12-31T23:00", "2016-12-31T23:00", [2015, 2016]),  # the calendar of central Europe
        ("2016-03-01", "2017-03-01", [2016]),
        ("2017-01-01", "2018-07-01", [2017]),  # half a year more does not make one
        ("2017-06-01", "2017-07-01", []),
    ],
)
def test_years_of_a_time_axis(start, stop, expected):
    times = pd.date_range(start, stop, freq="h", inclusive="left", tz="UTC")
    years = split_years(times, HOUR)
    assert [year for year, _ in years] == expected
    leap = [year == 2016 and start[5:7] != "03" for year in expected]
    assert [len(inside) for _, inside in years] == [8784 if one else 8760 for one in leap]


@pytest.mark.slow
def test_hours_of_the_sun(tmp_path):
    """East and west roofs together give as much before as after solar noon, which comes at 5:20 UTC
    at 100° E.
    """
    clear = read_weather("clear-sky", 10.0, 100.0)
    suns = choose_suns("hourly", clear.data.index, clear.interval, 10.0, 100.0)
    energy = compute_energy(unshaded_transfer(suns, [16, 16], [90, 270]), clear)
    write_groups(tmp_path / "groups.csv", energy)
    table = pd.read_csv(tmp_path / "groups.csv")
    for period, noon in (("solar_hour", 12.0), ("hour", 12 - 100 / 15)):
        rows = table[table["period"] == period].groupby("index")["full_load_hours"].sum()
        middle = (
            np.angle((np.exp(2j * np.pi * (rows.index + 0.5) / 24) * rows).sum())
            / (2 * np.pi)
            * 24
            % 24
        )
        assert middle == pytest.approx(noon, abs=0.1)
        assert rows.sum() == pytest.approx(energy.capacity_factor.sum(), rel=1e-4)


@pytest.fixture(scope="module")
def traced(city, tmp_path_factory):
    folder = tmp_path_factory.mktemp("traced")
    common = [
        "--weather",
        str(ERA5),
        "--suns",
        "typical-days:2",
        "--samples",
        "16",
        "--shadow-samples",
        "4",
        "--quiet",
    ]
    assert main(["simulate", str(city), "--out", str(folder / "out"), *common]) == 0
    return folder


def run_yield(traced, out, *options):
    arguments = [
        "yield",
        str(traced / "out" / "transfer.nc"),
        "--weather",
        str(ERA5),
        "--quiet",
        "--out",
        str(out),
    ]
    return main([*arguments, *options])


def settings_in(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))["settings"]


@pytest.mark.slow
def test_options_reach_the_tables(traced, tmp_path, capsys):
    options = ["--losses", "14", "--usable", "facade=0.6,roof=0.8", "flat=0.5", "--monthly"]
    assert (
        run_yield(
            traced, tmp_path / "a", *options, "--series", "a_south", "b_roof_south", "buildings"
        )
        == 0
    )
    south = pd.read_csv(tmp_path / "a" / "faces.csv", index_col="surface_id").loc["a_south"]
    hours = south["full_load_hours"]
    assert 0.75 * south["full_load_hours_dc"] < hours < 0.86 * south["full_load_hours_dc"]
    assert sum(south[f"full_load_hours_{month:02d}"] for month in range(1, 13)) == pytest.approx(
        hours, rel=1e-4
    )
    assert (
        south["open_area"] <= south["area"] and settings_in(tmp_path / "a")["usable"]["flat"] == 0.5
    )
    series = pd.read_csv(tmp_path / "a" / "series.csv")
    assert series["surface_id"].unique().tolist() == ["a_south", "b_roof_south"]
    buildings = pd.read_csv(tmp_path / "a" / "buildings.csv")
    place = buildings[["easting", "northing"]].to_numpy() - [EAST, NORTH]
    np.testing.assert_allclose(place, [[6, 5], [25, 4], [9, 28.5]], atol=1e-3)  # houses a, b and c
    with xr.open_dataset(tmp_path / "a" / "timeseries.nc") as file:
        assert file["building"].to_numpy().tolist() == buildings["building_id"].tolist()
        np.testing.assert_allclose(
            file["building_power"].sum("time") / 1000, buildings["mwh_per_year"], rtol=1e-4
        )
    groups = pd.read_csv(tmp_path / "a" / "groups.csv")
    annual = groups[groups["period"] == "annual"]
    assert (annual["full_load_hours"] < 0.86 * annual["full_load_hours_dc"]).all()
    assert run_yield(traced, tmp_path / "b", "--series", "a_south", "nobody") == 2
    assert "--series" in capsys.readouterr().err and not (tmp_path / "b").exists()
    note = "traced for --clearance 0.3: places with less room than that are dark"
    for clearance, told in (("0.3", False), ("0.01", True)):
        arguments = [str(traced / "out" / "transfer.nc"), "--weather", str(ERA5)]
        arguments += ["--out", str(tmp_path / clearance), "--clearance", clearance]
        assert main(["yield", *arguments]) == 0
        assert (note in " ".join(capsys.readouterr().err.split())) == told
    assert run_yield(traced, tmp_path / "b", "--clearance", "0.2") == 2
    assert "give 0.01 or 0.3" in capsys.readouterr().err


@pytest.mark.slow
def test_the_paper_in_a_word(traced, tmp_path):
    assert run_yield(traced, tmp_path / "paper", "--method", "paper") == 0
    found = settings_in(tmp_path / "paper")
    assert {name: found[name] for name in METHODS["paper"]} == METHODS["paper"] and found[
        "method"
    ] == "paper"
    # Options given beside it win, also before it.
    assert (
        run_yield(traced, tmp_path / "own", "--hidden-walls", "leave-out", "--method", "paper") == 0
    )
    found = settings_in(tmp_path / "own")
    assert found["hidden_walls"] == "leave-out" and found["overhangs"] == "count"
    # The paper has no vegetation, whatever other effects are asked for.
    assert run_yield(traced, tmp_path / "aoi", "--method", "paper", "--effects", "aoi=off") == 0
    assert settings_in(tmp_path / "aoi")["effects"] == {"trees": False, "aoi": False}
    assert (
        run_yield(traced, tmp_path / "late", "--effects", "trees=off") == 2
    )  # was decided when traced
    assert settings_in(traced / "out")["hidden_walls"] == "leave-out"
