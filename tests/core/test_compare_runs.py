"""Two states of a city: surfaces are told by their shapes, sums add up, only what the change
reaches changes.
"""

import re

import pandas as pd
import pytest
from small_city import house, write_small_city

import citypv
from citypv.__main__ import main

# Days enough that the error of their choice, which runs share, is a small part of what is stated.
FEW = {"weather": "clear-sky", "samples": 64, "shadow_samples": 4, "suns": "days:12", "threads": 1}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("states")


@pytest.fixture(scope="module")
def before(folder):
    return citypv.simulate(write_small_city(folder / "small.gml"), **FEW)


def restate(folder, before, name, change):
    """Results of the city's file after a change of its text, at the same place."""
    path = folder / name
    path.write_text(change((folder / "small.gml").read_text(encoding="utf-8")), encoding="utf-8")
    return citypv.simulate(path, site_of=before.folder, **FEW)


@pytest.fixture(scope="module")
def after(folder, before):
    """A tower of 40 m south of the first house in place of the third house."""

    def change(text):
        text = re.sub(
            r'<cityObjectMember><bldg:Building gml:id="c">.*?</cityObjectMember>\n',
            "",
            text,
            flags=re.S,
        )
        return text.replace("</CityModel>", house("tower", (0, -16), (12, 10, 40)) + "</CityModel>")

    return restate(folder, before, "after.gml", change)


@pytest.mark.slow
def test_the_same_city_under_other_names(folder, before):
    """Random numbers follow from names: all surfaces are found, and differ by their
    errors alone.
    """
    renamed = restate(
        folder, before, "names.gml", lambda text: re.sub(r'gml:id="([abc])_', r'gml:id="z\1', text)
    )
    found = citypv.compare(before, renamed).surfaces.dropna(subset="full_load_hours_change")
    assert set(found["state"]) == {"existing"} and len(found) == 18
    deviation = found["full_load_hours_change"] / found["full_load_hours_change_standard_error"]
    assert deviation.abs().max() < 4 and 0.3 < deviation.std() < 1.7
    same = citypv.compare(before, before).surfaces
    assert (same.filter(like="_change").fillna(0) == 0).all(axis=None)


@pytest.mark.slow
def test_neighbours_lose_and_sums_add_up(before, after):
    found = citypv.compare(before, after)
    assert re.fullmatch(
        r"<citypv\.Comparison \S+ to \S+: [\d,]+ buildings?, [+−]?[\d,]+ MWh a year>", repr(found)
    )
    states = found.buildings.set_index("building_id")["state"].to_dict()
    assert states == {"a": "existing", "b": "existing", "c": "gone", "tower": "new"}
    south = found.surfaces.set_index("surface_id").loc["a_south"]
    assert south["full_load_hours_change"] < -5 * south["full_load_hours_change_standard_error"] < 0
    difference = south["full_load_hours_after"] - south["full_load_hours_before"]
    assert south["full_load_hours_change"] == pytest.approx(difference)
    sums = found.summary["sums"]
    for name in ("mwh_before", "mwh_after", "mwh_change"):
        parts = sum(sums[state][name] for state in ("existing", "changed", "new", "gone"))
        assert sums["all"][name] == pytest.approx(parts)
    assert sums["all"]["mwh_change"] == pytest.approx(
        sums["all"]["mwh_after"] - sums["all"]["mwh_before"]
    )
    assert sums["gone"]["mwh_after"] == sums["new"]["mwh_before"] == 0
    assert sums["existing"]["mwh_change"] < 0 < sums["new"]["mwh_change"]
    for result, column in (
        (before, "mwh_before"),
        (after, "mwh_after"),
    ):  # the program's own sums, by another way
        energy = result.buildings["mwh_per_year"]
        own = dict(zip(result.buildings["building_id"], energy, strict=True))
        told = dict(zip(found.buildings["building_id"], found.buildings[column], strict=True))
        assert own == pytest.approx({name: told[name] for name in own}, rel=1e-4)


@pytest.mark.slow
def test_files_and_page(before, after, folder, capfd):
    assert (
        main(["compare", str(before.folder), str(after.folder), "--out", str(folder / "out")]) == 0
    )
    said = capfd.readouterr().err
    assert re.search(r"Existing buildings that stay as they are: −[\d.]+ ± [\d.]+ MWh a year", said)
    # Neighbours alone are named: the removed house loses more, the tower gains more.
    assert (
        re.search(r"Lose most: a −\d+\.\d\d MWh(, b −[\d.]+ MWh)?\n", said)
        and "Gain most" not in said
    )
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    assert "Who loses, who gains" in page and page.count("<img") == 2
    table = pd.read_csv(folder / "out" / "buildings.csv")
    assert table["mwh_change"].is_monotonic_increasing
    assert (folder / "out" / "surfaces.csv").exists()


@pytest.mark.slow
def test_only_the_city_may_differ(before, folder):
    with pytest.raises(citypv.InputError, match="differ in --sectors; compute both"):
        citypv.compare(before, before.with_weather("clear-sky", sectors="paper"))
    other = before.with_weather("clear-sky", losses=3.0, year=2019)
    words = "differ in the weather, the hours, --losses, --year; compute both with the same"
    with pytest.raises(citypv.InputError, match=words):
        citypv.compare(before, other)
