"""What reading came upon, with counts and areas that can be told without rays or from the file
itself.
"""

import json

import numpy as np
import pytest
from cities import box, make_city
from small_city import EAST, NORTH, write_small_city
from test_read_citygml import EXPECTED, find

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.city.city import ImportReport
from citypv.core.commands.inspect_city import describe_city, inspect_city
from citypv.core.energy.counted_area import REASONS
from citypv.core.results.list_findings import list_findings
from citypv.core.settings.errors import list_some, show_number
from citypv.core.settings.request import Request

CLOSING, FOOT, SHARED = (REASONS[name] for name in ("closure", "ground", "covered"))


def findings_of(city):
    scene = build_scene(city, 50.0, 8.0, patch_size=None)
    return {finding.reason: finding for finding in list_findings(scene)}


def test_wall_shared_by_two_houses_lies_inside_with_both_its_sides():
    city = make_city([*box("a", 0, 0, 10, 8, 0, 6), *box("b", 10, 0, 10, 8, 0, 6)])
    found = findings_of(city)
    assert found[SHARED].area == pytest.approx(2 * 8 * 6)
    east_of_a, west_of_b = (
        k
        for k in range(len(city))
        if np.ptp(city.rings(k)[0][:, 0]) == 0 and city.rings(k)[0][0, 0] == 10
    )
    assert found[SHARED].surfaces.tolist() == [east_of_a, west_of_b]
    assert found[FOOT].area == pytest.approx(2 * 80)


def test_wall_shared_for_a_third_is_not_called_inside():
    found = findings_of(make_city([*box("a", 0, 0, 10, 8, 0, 18), *box("b", 10, 0, 10, 8, 0, 6)]))
    assert found[SHARED].area == pytest.approx(8 * 6)  # that of the low house alone
    assert SHARED not in findings_of(make_city(box("a", 0, 0, 10, 8, 0, 6)))


def test_repaired_cells_are_found_under_the_id_they_were_cut_from():
    city = make_city(box("a", 0, 0, 10, 8, 0, 6))
    city.report = ImportReport(repaired={"mended": ["s2"]}, skipped={"gone": ["y"]})
    city.report.skip("lost", ["x"], 3.5)
    scene = build_scene(city, 50.0, 8.0, options=SceneOptions(grid_size=2.0))
    found = {finding.reason: finding for finding in list_findings(scene)}
    assert {scene.surfaces.surface_id[k].partition("#")[0] for k in found["mended"].surfaces} == {
        "s2"
    }
    assert found["mended"].area == pytest.approx(10 * 6)
    assert (found["lost"].area, found["gone"].area) == (3.5, None)


def test_numbers_and_ids_as_a_report_writes_them():
    told = [show_number(value, 1, plus=True) for value in (-0.04, 0.04, -1234.56, 7)]
    assert told == ["0.0", "0.0", "−1,234.6", "+7.0"] and show_number(-0.0, 0) == "0"
    assert (
        list_some(["UUID_0a1b2c3d-4e5f-6789", "b"]) == "…2c3d-4e5f-6789, b"
        and list_some("abcd") == "a, b, c …"
    )


@pytest.mark.slow
def test_closure_surfaces_of_the_real_tile_are_switched_off():
    name = "nrw_LoD2_32_280_5659_1_NW.gml"
    count, area = EXPECTED[name]["area_by_lod_class"]["lod2:ClosureSurface"]
    found = inspect_city([find(name)], Request())
    rows = {row["reason"]: row for row in found["findings"]}
    closing = rows[CLOSING]
    assert closing["count"] == count
    assert closing["area"] == pytest.approx(area, rel=1e-3)
    assert rows[FOOT]["count"] == EXPECTED[name]["area_by_lod_class"]["lod2:GroundSurface"][0]
    assert len(rows[SHARED]["ids"]) == rows[SHARED]["count"] > 100
    json.dumps(found)
    assert any(line.startswith("inside 126: closes a building") for line in describe_city(found))


@pytest.mark.slow
def test_terrain_counts_in_the_inspection(tmp_path):
    city = write_small_city(tmp_path / "city.gml")
    rows = "\n".join(["28 " * 60] * 60)  # [m] two below the houses' feet
    head = f"ncols 60\nnrows 60\nxllcorner {EAST - 280}\nyllcorner {NORTH - 280}\ncellsize 10\n"
    (tmp_path / "ground.asc").write_text(head + rows, encoding="utf-8")
    request = Request(terrain=str(tmp_path / "ground.asc"))
    carried = next(
        row for row in inspect_city([city], request)["findings"] if "extended down" in row["reason"]
    )
    assert (carried["heading"], carried["count"]) == ("repaired", 12)  # the walls of three houses
    assert not any(
        "extended down" in row["reason"] for row in inspect_city([city], Request())["findings"]
    )
