"""Packets and single rays answer alike, and single rays stand in where packets do not work."""

import numpy as np
import pytest
from scenes import run_gather, scene_of_triangles, suns_towards
from test_town import TOWN
from test_tracing import three_houses

from citypv.core.rays import engines
from citypv.core.rays.engines import LibraryError
from citypv.core.rays.ray_scene import RayScene
from citypv.core.settings.errors import InputError


@pytest.fixture
def afresh(monkeypatch):
    """As in a new process in which nobody has asked for an engine."""
    monkeypatch.delenv(engines.VARIABLE, raising=False)
    engines.fault_of_packets.cache_clear()
    yield
    engines.fault_of_packets.cache_clear()


def test_packets_prove_themselves_here(afresh):
    engine, reason = engines.choose_engine()
    assert engine == "packets", reason


@pytest.mark.slow
def test_the_town_is_the_same_by_either():
    """Of 200,000 rays of each kind at most one in 100,000 is answered differently."""
    town = np.load(TOWN)
    scene = scene_of_triangles(town["vertices"], town["triangles"])
    trees = [RayScene(scene.vertices, scene.triangles, engine) for engine in engines.TREES]
    generator = np.random.default_rng(5)
    corners = scene.vertices[scene.triangles[generator.integers(0, len(scene.triangles), 200_000)]]
    weight = generator.dirichlet([1, 1, 1], len(corners))[:, :, None]
    directions = generator.normal(size=(len(corners), 3)).astype(np.float32)
    origins = ((corners * weight).sum(axis=1) + 0.01 * directions).astype(np.float32)
    hits = [tree.trace_closest(origins, directions) for tree in trees]
    assert (hits[0] != hits[1]).mean() <= 1e-5
    assert (hits[0] >= 0).mean() > 0.3
    position, wanted = origins.reshape(-1, 16, 3), np.ones((len(origins) // 16, 1), bool)
    for sun in town["sun"][::40].astype(np.float32):
        free = [tree.trace_shadow_rays(position, wanted, sun[None]) for tree in trees]
        assert (free[0] != free[1]).mean() <= 1e-5
        assert 0.05 < free[0].mean() < 0.95
    places = [tree.trace_places(origins, directions) for tree in trees]
    alike = (hits[0] == hits[1]) & (hits[0] >= 0)
    assert np.abs(places[0][1] - places[1][1])[alike].max() < 1e-3


@pytest.mark.parametrize("points", [1, 4, 5, 16, 64])
def test_packets_of_any_number_of_points(points):
    scene = three_houses()
    trees = [RayScene(scene.vertices, scene.triangles, engine) for engine in engines.TREES]
    generator = np.random.default_rng(points)
    position = generator.uniform([-40, -40, 0.1], [40, 40, 20], (50, points, 3)).astype(np.float32)
    wanted = generator.random((50, 3)) < 0.5
    directions = np.float32([[0.2, -0.5, 1], [0.7, 0.7, 0.6], [-0.8, 0.1, 0.3]])
    one, other = (tree.trace_shadow_rays(position, wanted, directions) for tree in trees)
    assert np.array_equal(one, other)
    assert one.any()
    assert not one[~wanted].any()


def test_without_a_library_single_rays_stand_in(afresh, monkeypatch):
    def nothing():
        raise LibraryError("embreex has no Embree 4 library bundled")

    monkeypatch.setattr("citypv.core.rays.engines.load_library", nothing)
    assert engines.choose_engine() == (
        "rays",
        "no packets: embreex has no Embree 4 library bundled",
    )
    transfer = run_gather(three_houses(), suns_towards([[0.2, -0.5, 1]]))
    assert transfer.record.engine == "rays"
    monkeypatch.setenv(engines.VARIABLE, "packets")
    with pytest.raises(InputError, match="packets do not work here"):
        engines.choose_engine()


def test_packets_that_answer_wrongly_are_not_used(afresh, monkeypatch):
    right = engines.PacketTree.trace_shadow_rays
    monkeypatch.setattr(engines.PacketTree, "trace_shadow_rays", lambda *given: ~right(*given))
    assert engines.choose_engine() == (
        "rays",
        "no packets: shadows differ from those of single rays",
    )


def test_a_library_without_the_functions_is_refused(monkeypatch):
    monkeypatch.setattr(engines, "PROTOTYPES", {"rtcNoSuchFunction": (None, [])})
    with pytest.raises(LibraryError, match="rtcNoSuchFunction"):
        engines.load_library.__wrapped__()


def test_an_engine_that_does_not_exist_is_refused(monkeypatch):
    monkeypatch.setenv(engines.VARIABLE, "magic")
    with pytest.raises(InputError, match="'magic' is not an engine; set it to packets or rays"):
        engines.choose_engine()
