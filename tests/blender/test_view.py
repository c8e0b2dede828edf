"""The whole city is seen between toolbar, sidebar and headers of the 3D view: projected as Blender
does.
"""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from mathutils import Quaternion, Vector

from citypv.operators.show.show_city import look_at

LENS, SENSOR = 50.0, 36.0  # [mm]; a 3D view shows twice the sensor's width along its longer side


def make_area(width, height, toolbar, sidebar, header):
    """A 3D view of some size, with a toolbar and a sidebar of some width over its sides, and two
    headers on top.
    """
    view = SimpleNamespace(type="WINDOW", x=3, y=40, width=width, height=height)
    tools = SimpleNamespace(type="TOOLS", x=3, width=toolbar)
    side = SimpleNamespace(type="UI", x=3 + width - sidebar, width=sidebar)
    tops = [
        SimpleNamespace(type="HEADER", y=40 + height),
        SimpleNamespace(type="TOOL_HEADER", y=40 + height - header),
    ]
    shown = {"show_region_toolbar": toolbar > 1, "show_region_ui": sidebar > 1}
    shown |= {"show_region_header": True, "show_region_tool_header": header > 0}
    space = SimpleNamespace(lens=LENS, region_3d=SimpleNamespace(), **shown)
    return SimpleNamespace(regions=[view, tools, side, *tops], spaces=SimpleNamespace(active=space))


def project(area, points):
    """Pixels of points from the view's left lower corner: (n, 2)."""
    region, view = area.spaces.active.region_3d, area.regions[0]
    turn = np.array(Quaternion(region.view_rotation).to_matrix())
    eye = np.array(region.view_location) + region.view_distance * turn[:, 2]
    x, y, z = (points - eye) @ turn[:, 0], (points - eye) @ turn[:, 1], -(points - eye) @ turn[:, 2]
    pixels = max(view.width, view.height) * LENS / (2 * SENSOR)
    return np.column_stack((view.width / 2 + pixels * x / z, view.height / 2 + pixels * y / z))


@pytest.mark.parametrize(
    ("size", "extent"),
    [
        ((1050, 640, 52, 286, 26), (600.0, 300.0, 40.0)),
        ((600, 900, 52, 200, 52), (20.0, 20.0, 200.0)),
        ((800, 500, 1, 1, 0), (30.0, 30.0, 9.0)),
    ],
)
def test_the_whole_city_is_seen_between_toolbar_sidebar_and_headers(size, extent):
    corners = np.array(list(product(*[(-side / 2, side / 2) for side in extent]))) + np.array(
        [70.0, -20.0, 5.0]
    )
    area = make_area(*size)
    look_at(area, corners)
    found, (left, right) = (
        project(area, corners),
        (width if width > 1 else 0 for width in size[2:4]),
    )
    free = size[0] - left - right
    assert found[:, 0].min() >= left
    assert found[:, 0].max() <= left + free
    assert found[:, 1].min() >= 0
    assert found[:, 1].max() <= size[1] - size[4]
    # It fills the free part in one direction, and stands in its middle from side to side, but for
    # the perspective.
    spans = np.ptp(found, axis=0) / (free, size[1] - 2 * size[4])
    assert spans.max() > 0.75
    assert (found[:, 0].min() + found[:, 0].max()) / 2 == pytest.approx(
        left + free / 2, abs=0.05 * free
    )
    assert isinstance(area.spaces.active.region_3d.view_location, Vector)
