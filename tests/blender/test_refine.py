"""Rounds of a trace: shown one by one, the same numbers as on the command line, and kept when
cancelled.
"""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from steps import here, run, session_here

from citypv.core.results.transfer_file import read_transfer
from citypv.core.run.simulate import simulate
from citypv.core.settings.progress import CancelledError
from citypv.core.settings.request import Request
from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.run.trace_city import TraceCity, show_round


@pytest.fixture
def goal(addon, city_file):
    """The street, classified, with a target that takes some rounds."""
    run("import_city", "classify", city_path=str(city_file), samples=16, shadow_samples=4, days=4)
    seeing = bpy.context.scene.citypv_seeing
    seeing.refine, seeing.target_error, seeing.time_budget = True, 1.5, 0.0
    return seeing


@pytest.mark.slow
def test_every_round_is_shown_and_the_last_has_the_numbers_of_the_command_line(
    goal, city_file, tmp_path
):
    city, shown = here(), []
    task = TraceCity.prepare(SimpleNamespace(), bpy.context)

    def progress(stage, done, total, unit):
        # As the timer of the window does.
        rounds = [task[-1].get()[1] for _ in range(task[-1].qsize())]
        for session, transfer, energy in rounds[-1:]:
            expected = energy.full_load_hours
            show_round(bpy.context, session, transfer, energy)
            faces = read_face_attribute(city.data, "surface")
            found = read_face_attribute(city.data, "full_load_hours")
            np.testing.assert_allclose(found, expected[faces], rtol=1e-6)
            shown.append((city["citypv_colour_attribute"], np.nanmean(found)))

    TraceCity.finish(None, bpy.context, TraceCity.work(task, progress))
    assert len(shown) >= 2
    assert {name for name, _ in shown} == {"full_load_hours"}
    assert len({mean for _, mean in shown}) == len(shown)
    transfer = session_here().transfer
    request = Request(
        weather="climate", samples=16, shadow_samples=4, suns="days:4", target_error=1.5
    )
    simulate([city_file], tmp_path / "out", request)
    same = read_transfer(tmp_path / "out" / "transfer.nc")
    assert same.record.rounds == transfer.record.rounds > 2
    np.testing.assert_allclose(transfer.diffuse_relative, same.diffuse_relative, rtol=1e-6)
    np.testing.assert_allclose(transfer.visible_share, same.visible_share, atol=1e-6)


@pytest.mark.slow
def test_escape_among_the_rounds_keeps_those_that_are_finished(goal):
    goal.target_error, rounds = 0.01, []
    task = TraceCity.prepare(SimpleNamespace(), bpy.context)

    def progress(stage, done, total, unit):
        while not task[-1].empty():
            rounds.append(task[-1].get()[1][1].record.rounds)
        if len(rounds) == 2:
            raise CancelledError

    TraceCity.finish(None, bpy.context, TraceCity.work(task, progress))
    transfer = session_here().transfer
    assert transfer.record.rounds == rounds[-1]
    assert not transfer.record.interrupted
    run("energy")
